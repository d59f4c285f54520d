#pragma once

#include <cstdint>

#include "base/options.h"
#include "pendulum/scale.h"

/// Settings of the computed controllers. This header includes no mathematics, so commands can
/// include it cheaply.
namespace upswing {

/// Weights of the minimised cost Σ x' Q x + R u² over the control steps. x = [q1 - π, q2, w1, w2]
/// (rad, rad/s), u the torque (N·m), Q diagonal.
struct LqrConfig {
  double q1 = 10, q2 = 10;  // of Q, 1/rad²
  double w1 = 1, w2 = 1;    // of Q, s²/rad²
  double torque = 1;        // R, 1/(N·m)²

  /// These settings of the built-in plant for a plant of these natural units.
  LqrConfig In(const Scale& scale) const;
  /// Declares each setting in `options`: name, range, unit, help.
  void Describe(Options& options);
};

/// Settings of the predictive controller. Its cost is the regulator's cost over the horizon plus
/// the regulator's x' P x at the end.
struct MpcConfig {
  double seconds = 2.5;      // length of the horizon, s
  int64_t iterations = 2;    // iterations of trajectory optimisation at each decision
  int64_t guesses = 1;       // constant torques that the first plan is improved from
  double angle_range = 1e6;  // largest angle of an upright goal, with full turns, rad
  double velocity = 1e6;     // of the motor's joint, above which mpc brakes, rad/s

  MpcConfig In(const Scale& scale) const;
  /// Declares each setting in `options`: name, range, unit, help.
  void Describe(Options& options);
};

/// Settings of the swing-up's planner. Its cost is the regulator's cost over the plan plus the
/// regulator's x' P x at the end.
struct SwingUpConfig {
  double seconds = 4;    // length of the plan, s
  double reserve = 0.2;  // share of the motor's torque that the plan reserves for feedback

  SwingUpConfig In(const Scale& scale) const;
  /// Declares each setting in `options`: name, range, unit, help.
  void Describe(Options& options);
};

/// Weights of the energy law.
struct EnergyShapingConfig {
  double kE = 0.0018;   // weight of energy, 1/(J²·s)
  double kD = 0.00067;  // weight of velocity, s
  double kP = 0.27;     // weight of link 1's angle, 1/s

  EnergyShapingConfig In(const Scale& scale) const;
  void Describe(Options& options);
};

/// Gains of partial feedback linearisation.
struct PartialFeedbackConfig {
  double kP = 4, kD = 7, kE = 3;  // 1/s², 1/s, 1/(J·s)

  PartialFeedbackConfig In(const Scale& scale) const;
  void Describe(Options& options);
};

}  // namespace upswing
