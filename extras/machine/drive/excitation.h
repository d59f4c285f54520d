#pragma once

#include <functional>

#include "base/rng.h"
#include "pendulum/scale.h"
#include "pendulum/task.h"

namespace upswing::machine {

/// Torques that show how a machine moves: random steps, which grow until the links move enough.
/// Some of them push along with the motion, so that a weak motor swings heavy links, too.
class Excitation {
 public:
  /// The share of the permitted motion that a state has; the torques keep it below 1.
  using Level = std::function<double(const PendulumState&)>;

  /// `limit`: largest torque, N·m. `joint`: that of the motor, 1 or 2. `scale`: natural units of
  /// the machine over those of UsualPlant.
  Excitation(double limit, int joint, Level level, uint64_t seed, const Scale& scale = {})
      : limit_(limit),
        slow_(kSlow * scale.velocity()),
        joint_(joint),
        amplitude_(kFirst * limit),
        level_(std::move(level)),
        rng_(seed, "machine: excitation") {}

  /// The motor's torque (N·m) in a step of 20 ms by the scale of the machine; see
  /// MachineController.
  double operator()(int64_t step, const PendulumState& state);

 private:
  static constexpr double kFirst = 0.01;  // first amplitude, as a share of the limit
  static constexpr double kSlow = 0.5;    // velocity without a direction of UsualPlant, rad/s

  double limit_;  // N·m
  double slow_;   // rad/s
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
