#pragma once

#include <Eigen/Core>

#include "realaigym/rules.h"

/// The benchmark's plant as a linear system about upright at rest, and its regulator.
namespace upswing {

/// ẋ = A x + B u, x = [q1 - π, q2, w1, w2], u the motor's torque (N·m); without dry friction.
struct GymLinear {
  Eigen::Matrix4d A;
  Eigen::Vector4d B;
};
GymLinear LinearizeUpright(const GymPlant& plant, GymRobot robot);

/// The regulator that minimises ∫ x' Q x + R u² dt, Q diagonal: u = -K x, and the cost x' P x.
struct GymRegulator {
  Eigen::RowVector4d K;
  Eigen::Matrix4d P;
};
GymRegulator SolveGymRegulator(const GymLinear& model, const Eigen::Vector4d& Q, double R);

}  // namespace upswing
