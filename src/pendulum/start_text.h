#pragma once

#include <string>
#include <string_view>

#include "pendulum/plant.h"

/// Start states as texts on command lines: q1,q2,w1,w2 with optional units.
namespace upswing {

/// Parses an angle: `180deg`, `180°`, `3.14rad`, or a number in rad, which may be at most 4π: a
/// larger one is meant in degrees. Returns rad. Throws BadInput that begins with `where`.
double ParseAngle(std::string_view text, const std::string& where);
/// The same in degrees. Whole degrees stay whole.
double ParseDegrees(std::string_view text, const std::string& where);
/// Parses a velocity: `90deg/s`, `90°/s`, `1.5rad/s`, or a number in rad/s. Returns rad/s.
double ParseVelocity(std::string_view text, const std::string& where);

/// Parses q1,q2,w1,w2. Throws BadInput that begins with `where`.
PendulumState ParseState(const std::string& text, const std::string& where);

/// A state with units, such as `q1 3.142, q2 0 rad (180°, 0°), w1 0, w2 0 rad/s`.
std::string StateText(const PendulumState& state);

}  // namespace upswing
