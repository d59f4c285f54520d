#pragma once

#include <Eigen/Core>

#include "sim/manipulator.h"

/// The double pendulum as a linear system about upright at rest.
namespace upswing {

/// ẋ = A x + B u, or x⁺ = A x + B u over one control period.
/// x = [q1 - π, q2, w1, w2]: deviation from upright at rest, rad and rad/s. u: torque of the
/// motor, N·m, which is not limited here.
struct LinearModel {
  Eigen::Matrix4d A;
  Eigen::Vector4d B;
};

/// The equations of motion, linearised about upright at rest: continuous time. Dry friction is left
/// out: its slope at rest holds within 0.01 rad/s alone.
LinearModel LinearizeUpright(const Manipulator& plant, int actuated_joint);
LinearModel LinearizeUpright(const Plant& plant);

/// A continuous model over `steps` Runge-Kutta steps of `h` seconds with the torque held: the
/// Jacobian, at upright, of the steps that the simulation makes (both engines). This is what a
/// controller meets there; the exact zero-order hold differs by 6e-8 with the standard plant.
LinearModel Discretize(const LinearModel& continuous, double h, int steps);

}  // namespace upswing
