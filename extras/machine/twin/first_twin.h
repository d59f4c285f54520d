#pragma once

#include <span>

#include "extras/machine/twin/twin.h"

namespace upswing::machine {

/// A first guess of a twin for Fit, without any known mass, length or friction. The equations of
/// motion are linear in their constants. Integrated over 0.2 s, by the scale of the known plant,
/// they need no acceleration, and least squares solve them. Delay and lag have the values with the
/// least error.
///
/// A motion determines only ratios of masses, so the links are uniform rods. `known` has the torque
/// limit, size (ScaleOverUsual), gravity, sensors and period. Throws BadInput if the logs are too
/// short.
Twin FirstTwin(std::span<const MachineLog> logs, const Twin& known);

/// The twin with the same equations of motion, but with links that are uniform rods. A fit that
/// keeps the masses may reach the limits of inertias and centres; with other masses it does not.
Twin AsRods(Twin twin);

}  // namespace upswing::machine
