#pragma once

#include <array>

#include "pendulum/dynamics.h"

/// The equations of motion as a linear function of the constants of Manipulator (Atkeson, An and
/// Hollerbach, "Estimation of inertial parameters of manipulator loads and links", 1986). A factor
/// is the torque at a joint for a constant of 1, while all other constants are 0.
namespace upswing {

/// Columns of the constants of Manipulator, in its order.
namespace column {
enum Constant { kJ1, kJ2, kB, kA, kG1, kG2, kD1, kD2, kF1, kF2 };
}
inline constexpr std::array kManipulatorConstants{
    &Manipulator::J1, &Manipulator::J2, &Manipulator::b,  &Manipulator::a,  &Manipulator::G1,
    &Manipulator::G2, &Manipulator::d1, &Manipulator::d2, &Manipulator::f1, &Manipulator::f2};
inline constexpr int kNumManipulatorConstants = static_cast<int>(kManipulatorConstants.size());
static_assert(kNumManipulatorConstants == column::kF2 + 1);

/// Factors of the constants for each joint.
using Factors = std::array<std::array<double, kNumManipulatorConstants>, 2>;

/// Y(q, q̇, q̈): the torque at each joint is Y p, for the constants p.
Factors Regressor(const dynamics::JointAngles<double>& angles,
                  const dynamics::JointPair<double>& velocity,
                  const dynamics::JointPair<double>& acceleration);

/// The same equations without accelerations and without dry friction, whose factors are 0: the
/// torque is d/dt(momentum p) + force p.
struct MomentumRegressor {
  Factors momentum;  // M(q) q̇
  Factors force;
};
MomentumRegressor MomentumRegressorOf(const dynamics::JointAngles<double>& angles,
                                      const dynamics::JointPair<double>& velocity);

}  // namespace upswing
