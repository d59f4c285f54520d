#pragma once

#include <optional>
#include <span>
#include <string>

#include "extras/machine/logs/log.h"
#include "extras/machine/twin/twin.h"

/// The length of link 1 that a motion shows. In the equations of motion the coupling of the links
/// over the gravity of link 2 is length1 / g, whatever the masses, centres and torques. A fit to
/// logs with torques takes its lengths as given, so a length or a clock that is wrong makes all its
/// other values wrong. (Without torques length1 is fitted, and nothing contradicts it.)
namespace upswing::machine {

struct LengthByMotion {
  double length;     // of link 1, m
  double deviation;  // standard deviation of its logarithm
};

/// The length by the logs, for the twin's gravity. Nothing if too few of their windows move.
std::optional<LengthByMotion> FindLengthByMotion(std::span<const MachineLog> logs,
                                                 const Twin& twin);

/// A line about a motion that contradicts the twin's length1, with what may be wrong; or "".
std::string LengthContradiction(std::span<const MachineLog> logs, const Twin& twin);

}  // namespace upswing::machine
