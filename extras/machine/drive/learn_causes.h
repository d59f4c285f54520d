#pragma once

#include <span>
#include <string>
#include <vector>

#include "extras/machine/drive/learn.h"
#include "extras/machine/twin/twin.h"

/// Why a machine does not balance, in words.
namespace upswing::machine {

/// A controller that did not balance the machine.
struct FailedTry {
  int candidate = 0;            // its index in CandidatesFor
  std::string controller = {};  // name with the settings
  int held = 0;                 // simulated machines, of kDraws, that it balances
  double balanced = 0;          // longest time upright, s
  std::string reason = {};      // of the supervisor; empty: none
  Twin twin = {};               // of its design
};

/// All that a session knows at its end.
struct SessionFacts {
  const LearnConfig& config;
  const Twin& twin;  // the last one
  std::span<const MachineLog> logs = {};
  std::span<const FailedTry> tries = {};
  bool is_identified = true;  // whether excitations have shown a twin
  bool is_faulty = false;     // whether the supervisor ended the session for a fault
};

/// Causes for which the logs speak, each in a clause.
std::vector<std::string> CausesOf(const SessionFacts& facts);

/// The limits that a fall from upright exceeds, in a clause each. A motor cannot hold links that
/// fall.
std::vector<std::string> FallsBeyond(const Twin& twin, const Limits& limits);

}  // namespace upswing::machine
