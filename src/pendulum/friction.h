#pragma once

#include <cmath>

#include "pendulum/plant.h"

namespace upswing {

/// Torque (N·m) of the dry friction f (N·m) against a velocity w (rad/s): f atan(100 w).
inline double DryFriction(double f, double w) { return f * std::atan(kFrictionSlope * w); }

}  // namespace upswing
