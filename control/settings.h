#pragma once

#include <cstdint>

#include "core/options.h"

/// Settings of the computed controllers. They name no mathematics, so that commands can have them
/// without it.
namespace upswing {

/// What is minimised: Σ x' Q x + R u² over the control steps, x = [q1 - π, q2, w1, w2] (rad,
/// rad/s), u the torque (N·m), Q diagonal.
struct LqrConfig {
  double q1 = 10, q2 = 10;  // of Q, 1/rad²
  double w1 = 1, w2 = 1;    // of Q, s²/rad²
  double torque = 1;        // R, 1/(N·m)²

  /// One line per setting: name, range, unit, help.
  void Describe(Options& options);
};

/// Settings of the predictive controller. The cost is that of the regulator, over the horizon, and
/// its x' P x at the end.
struct MpcConfig {
  double seconds = 2.5;    // horizon
  int64_t iterations = 2;  // of trajectory optimisation at each decision

  /// One line per setting: name, range, unit, help.
  void Describe(Options& options);
};

/// How the swing-up is planned. The cost is that of the regulator, over the plan's time, and its
/// x' P x at the end.
struct SwingUpConfig {
  double seconds = 4;    // length of the plan
  double reserve = 0.2;  // share of the motor's torque that the plan leaves to the feedback

  /// One line per setting: name, range, unit, help.
  void Describe(Options& options);
};

/// Weights of the energy law.
struct EnergyShapingConfig {
  double kE = 0.0018;   // of energy, 1/(J²·s)
  double kD = 0.00067;  // of velocity, s
  double kP = 0.27;     // of the angle of link 1, 1/s

  void Describe(Options& options);
};

/// Gains of partial feedback linearisation.
struct PartialFeedbackConfig {
  double kP = 4, kD = 7, kE = 3;  // 1/s², 1/s, 1/(J·s)

  void Describe(Options& options);
};

}  // namespace upswing
