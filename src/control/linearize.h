#pragma once

#include "control/riccati.h"
#include "pendulum/equations.h"

/// The double pendulum as a linear system about upright at rest: x = [q1 - π, q2, w1, w2], rad and
/// rad/s; u the torque of the motor, N·m, without a limit.
namespace upswing {

/// The equations of motion, linearised about upright at rest, in continuous time. They leave out
/// dry friction, because its slope at rest is valid only within 0.01 rad/s.
LinearModel LinearizeUpright(const Manipulator& plant, int actuated_joint);
LinearModel LinearizeUpright(const Plant& plant);

/// Turns a continuous model into `steps` Runge-Kutta steps of `h` seconds with the torque held. The
/// result is the Jacobian, at upright, of the steps that both simulation engines make. A controller
/// acts on this system; the exact zero-order hold differs by 6e-8 for the standard plant.
LinearModel Discretize(const LinearModel& continuous, double h, int steps);

}  // namespace upswing
