#include "control/linearize.h"

#include <numbers>
#include <unsupported/Eigen/AutoDiff>

#include "pendulum/dynamics.h"

namespace upswing {
namespace {

/// A number with its derivatives by q1, q2, w1, w2 and u.
using Dual = Eigen::AutoDiffScalar<Eigen::Matrix<double, 5, 1>>;

}  // namespace

LinearModel LinearizeUpright(const Manipulator& plant, int actuated_joint) {
  const Dual q1(std::numbers::pi, 5, 0), q2(0, 5, 1), w1(0, 5, 2), w2(0, 5, 3), u(0, 5, 4), none(0);
  const auto angles = dynamics::AnglesOf<Dual>({q1, q2});
  const dynamics::JointPair<Dual> tau{actuated_joint == 1 ? u : none,
                                      actuated_joint == 1 ? none : u};
  // Dry friction is left out; see linearize.h.
  const auto r = dynamics::NetTorque</*kFriction=*/false>(plant, angles, {w1, w2}, tau);
  const auto a = dynamics::AccelerationUnder(r, dynamics::MassAt(plant, angles.c2));

  LinearModel model;
  model.A << Eigen::Matrix2d::Zero(), Eigen::Matrix2d::Identity(),
      a.one.derivatives().head<4>().transpose(), a.two.derivatives().head<4>().transpose();
  model.B << 0, 0, a.one.derivatives()[4], a.two.derivatives()[4];
  return model;
}

LinearModel LinearizeUpright(const Plant& plant) {
  return LinearizeUpright(ManipulatorOf(plant), static_cast<int>(plant.actuated_joint));
}

LinearModel Discretize(const LinearModel& continuous, double h, int steps) {
  // [x, u] with u held is a linear system without an input. A Runge-Kutta step is then the start of
  // the exponential series: 1 + Z + Z²/2 + Z³/6 + Z⁴/24, with Z the system's matrix times h.
  using Matrix5d = Eigen::Matrix<double, 5, 5>;
  const Matrix5d one = Matrix5d::Identity();
  Matrix5d Z = Matrix5d::Zero();
  Z.topLeftCorner<4, 4>() = h * continuous.A;
  Z.topRightCorner<4, 1>() = h * continuous.B;
  const Matrix5d step = one + Z * (one + Z / 2 * (one + Z / 3 * (one + Z / 4)));
  Matrix5d all = one;
  for (int i = 0; i < steps; ++i) all = step * all;
  return {all.topLeftCorner<4, 4>(), all.topRightCorner<4, 1>()};
}

}  // namespace upswing
