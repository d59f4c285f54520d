#pragma once

#include <string>
#include <vector>

#include "extras/machine/twin/twin.h"

/// Values that no machine has, by which a fit shows that its model or its logs are wrong.
namespace upswing::machine {

/// A line for each value of a twin, or of a session of it, that is outside physics:
/// - a centre beyond its link;
/// - an inertia at its floor, or above that of the link's mass at a distance of two link lengths;
/// - an identified value at a limit of its range;
/// - a torque that acts before the cycle in which it is commanded;
/// - dry friction above gravity and the motor's torque.
/// `reports`: the logs have commanded and reported torques. Without reports, the commanded ones may
/// be measurements, which are some milliseconds old.
std::vector<std::string> OutsidePhysics(const Twin& twin, bool reports);

}  // namespace upswing::machine
