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
  MomentumRegressor of;
  of.momentum = FactorsOf(
      [&](const Manipulator& unit) { return Times(dynamics::MassAt(unit, angles.c2), velocity); });
  of.force = FactorsOf([&](const Manipulator& unit) -> Pair {
    // The rate of M times the velocity. M is linear in cos q2, and M22 is constant.
    const MassMatrix at0 = dynamics::MassAt(unit, 0.0), at1 = dynamics::MassAt(unit, 1.0);
    const double rate = -angles.s2 * velocity.two;
    const Pair moved =
        Times({rate * (at1.M11 - at0.M11), rate * (at1.M12 - at0.M12), 0, 0}, velocity);
    const Pair net = dynamics::NetTorque</*kFriction=*/false>(unit, angles, velocity, {0, 0});
    return {-moved.one - net.one, -moved.two - net.two};
  });
  return of;
}

}  // namespace upswing
