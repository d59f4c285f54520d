#pragma once

#include <Eigen/Core>

#include "realaigym/rules.h"

/// The benchmark's plant as a linear system about upright at rest, and its regulator.
namespace upswing {

/// ẋ = A x + B u, x = [q1 - π, q2, w1, w2], u the motor's torque (N·m); without dry friction.
struct BoardLinear {
  Eigen::Matrix4d A;
  Eigen::Vector4d B;
};
BoardLinear LinearizeUpright(const BoardPlant& plant, Robot robot);

/// The regulator that minimises ∫ x' Q x + R u² dt, Q diagonal: u = -K x, and the cost x' P x.
struct BoardRegulator {
  Eigen::RowVector4d K;
  Eigen::Matrix4d P;
};
BoardRegulator SolveBoardRegulator(const BoardLinear& model, const Eigen::Vector4d& Q, double R);

}  // namespace upswing
