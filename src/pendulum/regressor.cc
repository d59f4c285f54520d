#include "pendulum/regressor.h"

namespace upswing {
namespace {

using dynamics::JointAngles;
using dynamics::JointPair;
using Pair = JointPair<double>;

Pair Times(const MassMatrix& M, const Pair& x) {
  return {M.M11 * x.one + M.M12 * x.two, M.M12 * x.one + M.M22 * x.two};
}

/// The factors of each constant from `torque`, a linear function of the constants without dry
/// friction.
template <typename Torque>
Factors FactorsOf(const Torque& torque) {
  Factors factors;
  for (size_t k = 0; k < kManipulatorConstants.size(); ++k) {
    Manipulator unit{};
    unit.*kManipulatorConstants[k] = 1;
    const Pair t = torque(unit);
    factors[0][k] = t.one;
    factors[1][k] = t.two;
  }
  return factors;
}

}  // namespace

Factors Regressor(const JointAngles<double>& angles, const Pair& velocity,
                  const Pair& acceleration) {
  Factors factors = FactorsOf([&](const Manipulator& unit) -> Pair {
    const Pair inertial = Times(dynamics::MassAt(unit, angles.c2), acceleration);
    const Pair net = dynamics::NetTorque</*kFriction=*/false>(unit, angles, velocity, {0, 0});
    return {inertial.one - net.one, inertial.two - net.two};
  });
  factors[0][column::kF1] = DryFriction(1, velocity.one);
  factors[1][column::kF2] = DryFriction(1, velocity.two);
  return factors;
}

MomentumRegressor MomentumRegressorOf(const JointAngles<double>& angles, const Pair& velocity) {
  using namespace column;
  // momentum = M w. force = -Ṁ w - r for τ = 0, with Ṁ = -b s2 w2 [[2, 1], [1, 0]]: at joint 1 the
  // terms of b cancel.
  const auto& [w1, w2] = velocity;
  MomentumRegressor regressor{};
  auto& [momentum1, momentum2] = regressor.momentum;
  momentum1[kJ1] = w1;
  momentum1[kJ2] = momentum2[kJ2] = w1 + w2;
  momentum1[kB] = angles.c2 * (w1 + w1 + w2);
  momentum2[kB] = angles.c2 * w1;
  momentum2[kA] = w2;
  auto& [force1, force2] = regressor.force;
  force1[kG1] = angles.s1;
  force1[kG2] = force2[kG2] = angles.s12();
  force1[kD1] = w1;
  force2[kD2] = w2;
  force2[kB] = angles.s2 * w1 * (w1 + w2);
  return regressor;
}

}  // namespace upswing
