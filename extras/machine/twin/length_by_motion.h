#pragma once

#include <optional>
#include <span>
#include <string>

#include "extras/machine/logs/log.h"
#include "extras/machine/twin/twin.h"

/// The length of link 1 that a motion shows. In the equations of motion the coupling of the links
/// over the gravity of link 2 is length1 / g, whatever the masses, centres and torques. A length or
/// a clock that is wrong makes all other values of a fit wrong.
namespace upswing::machine {

struct LengthByMotion {
  double length;     // of link 1, m
  double deviation;  // standard deviation of its logarithm
};

/// The length by the logs, for the twin's gravity. Nothing if too few of their windows move.
std::optional<LengthByMotion> FindLengthByMotion(std::span<const MachineLog> logs,
                                                 const Twin& twin);

/// A line about a motion that contradicts `length1` (m), with what may be wrong; or "". The twin
/// has the gravity and the natural time.
std::string LengthContradiction(std::span<const MachineLog> logs, const Twin& twin,
                                double length1);

}  // namespace upswing::machine
