#pragma once

#include <span>

#include "extras/machine/twin.h"

namespace upswing::machine {

/// A twin from logs alone, as the first guess of a Fit: no mass, length or friction is known
/// before. The equations of motion are linear in their constants. Integrated over a tenth of a
/// second they need no acceleration, and least squares solve them. Delay and lag are those that fit
/// best.
///
/// Motion shows ratios of the constants only, so the links are taken as uniform rods. `known` has
/// the torque limit, gravity and sensors. Throws BadInput if the logs have too little motion.
Twin FirstTwin(std::span<const MachineLog> logs, const Twin& known);

}  // namespace upswing::machine
