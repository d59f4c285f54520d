#pragma once

#include "control/controller.h"
#include "control/manipulator.h"

/// Swing-up by laws of a formula each. They know nothing of the motor's limit; LQR catches what
/// they bring up (control/hybrid.h).
namespace upswing {

/// Weights of the energy law.
struct EnergyShapingConfig {
  double kE, kD, kP;  // of energy (1/J²), velocity (s²/rad²·J…) and angle of link 1

  EnergyShapingConfig() { SetDefaults(*this); }
  void Describe(Options& options);
};

/// Gains of partial feedback linearisation.
struct PartialFeedbackConfig {
  double kP, kD, kE;  // 1/s², 1/s, 1/(J·s)

  PartialFeedbackConfig() { SetDefaults(*this); }
  void Describe(Options& options);
};

/// Drives energy E to that of rest upright and link 1 to upright, so that link 2 swings through
/// upright again and again: Fantoni, Lozano, Spong, "Energy based control of the Pendubot", IEEE
/// Transactions on Automatic Control 45 (2000). For V = kE E²/2 + kD w1²/2 + kP q̃1²/2, without
/// damping, the torque makes dV/dt = -w1².
double EnergyShapingTorque(const EnergyShapingConfig& config, const Manipulator& plant,
                           const StateVector& deviation);

/// Makes q̈1 = -kP q̃1 - kD w1 - kE E w1 by collocated partial feedback linearisation: Spong,
/// "Partial feedback linearization of underactuated mechanical systems" (IROS 1994).
double PartialFeedbackTorque(const PartialFeedbackConfig& config, const Manipulator& plant,
                             const StateVector& deviation);

}  // namespace upswing
