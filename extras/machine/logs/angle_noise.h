#pragma once

#include <span>
#include <vector>

#include "extras/machine/logs/log.h"

/// The noise of angles that an encoder rounds and a file prints, measured by the smoothness of the
/// motion: high differences of a smooth motion vanish, those of noise do not.
namespace upswing::machine {

/// Equidistant values of a smooth quantity, such as the angles of a log or the errors of a model.
using Series = std::vector<double>;

/// Number of values after which the angle of a moving joint has mostly changed: 1 for a fine
/// encoder, more where the steps of an encoder are longer than the way in a cycle. `longest`: the
/// largest answer.
int StrideOf(std::span<const Series> angles, int longest);

/// The standard deviation of the noise on these values, by differences of values that are `stride`
/// apart: the least over the orders of the differences, because the motion only adds to them. 0 if
/// nothing moves.
double NoiseOf(std::span<const Series> values, int stride);

/// The standard deviation of the noise of a joint's angles (0 or 1) in all pieces, rad.
double AngleNoise(std::span<const MachineLog> pieces, int joint);

/// The step of an encoder whose rounding makes this noise: √12 times the deviation, rad.
double StepOfNoise(double noise);

}  // namespace upswing::machine
