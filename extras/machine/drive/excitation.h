#pragma once

#include <functional>

#include "base/rng.h"
#include "pendulum/task.h"

namespace upswing::machine {

/// Torques that show how a machine moves: random steps, which grow until the links move enough.
/// Some of them push along with the motion, so that a weak motor swings heavy links, too.
class Excitation {
 public:
  /// The share of the permitted motion that a state has; the torques keep it below 1.
  using Level = std::function<double(const PendulumState&)>;

  /// `limit`: largest torque, N·m. `joint`: that of the motor, 1 or 2.
  Excitation(double limit, int joint, Level level, uint64_t seed)
      : limit_(limit),
        joint_(joint),
        amplitude_(kFirst * limit),
        level_(std::move(level)),
        rng_(seed, "machine: excitation") {}

  /// The motor's torque (N·m) in a step of 20 ms; see MachineController.
  double operator()(int64_t step, const PendulumState& state);

 private:
  static constexpr double kFirst = 0.01;  // first amplitude, as a share of the limit

  double limit_;  // N·m
  int joint_;
  double amplitude_;  // N·m
  Level level_;
  Rng rng_;
  bool braking_ = false;
  int held_ = 0;        // steps for which the share stays
  double share_ = 0;    // of the amplitude
  bool along_ = false;  // whether the share has the sign of the motor's velocity
};

}  // namespace upswing::machine
