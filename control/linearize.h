#pragma once

#include "control/riccati.h"
#include "sim/manipulator.h"

/// The double pendulum as a linear system about upright at rest: x = [q1 - π, q2, w1, w2], rad and
/// rad/s; u the torque of the motor, N·m, which is not limited here.
namespace upswing {

/// The equations of motion, linearised about upright at rest: continuous time. Dry friction is left
/// out: its slope at rest holds within 0.01 rad/s alone.
LinearModel LinearizeUpright(const Manipulator& plant, int actuated_joint);
LinearModel LinearizeUpright(const Plant& plant);

/// A continuous model over `steps` Runge-Kutta steps of `h` seconds with the torque held: the
/// Jacobian, at upright, of the steps that the simulation makes (both engines). This is what a
/// controller meets there; the exact zero-order hold differs by 6e-8 with the standard plant.
LinearModel Discretize(const LinearModel& continuous, double h, int steps);

}  // namespace upswing
