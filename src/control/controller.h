#pragma once

#include <algorithm>
#include <memory>
#include <numbers>
#include <span>
#include <string>
#include <vector>

#include "base/policy.h"
#include "control/pendulum_model.h"
#include "pendulum/observation.h"
#include "pendulum/task.h"

namespace upswing {

/// The deviation from upright [q1 - π, q2, w1, w2], angles in [-π, π], of a state or of an
/// observation of pendulum/task.h in units of `scale`.
StateVector UprightDeviation(const StateVector& x);
StateVector UprightDeviation(std::span<const float> obs, const Scale& scale = {});

/// x - y, with the angles in [-π, π].
StateVector Difference(const StateVector& x, const StateVector& y);

/// The state with this deviation from upright.
inline StateVector FromUpright(const StateVector& d) {
  return {std::numbers::pi + d[0], d[1], d[2], d[3]};
}

/// x with four significant digits, such as 3.389.
std::string Rounded(double x);

/// A policy of the double pendulum that is computed from one plant's equations of motion.
class ComputedPolicy : public Policy {
 public:
  std::string kind() const override { return info_.agent; }
  int obs_size() const override { return kObservationSize; }
  int action_size() const override { return 1; }
  const PolicyInfo& info() const override { return info_; }
  /// Throws BadInput: a computed policy has no tensors, because each program computes it again.
  Tensors ToTensors() const override;

 protected:
  /// `settings` describes how the policy was computed.
  ComputedPolicy(const std::string& kind, const Options& settings, const DesignPlant& plant);

  const DesignPlant& plant() const { return plant_; }
  Scale scale() const { return ScaleIn(info_); }  // of observations
  /// Sets the observation, for parts that see more than one without memory, and its units.
  void SetObservation(const ObservationInfo& observation, const Scale& scale) {
    info_.observation = observation;
    SetScale(scale, info_);
  }
  /// A torque (N·m) cut at the motor's limit.
  double Limited(double u) const {
    return std::clamp(u, -plant_.torque_limit, plant_.torque_limit);
  }

 private:
  DesignPlant plant_;
  PolicyInfo info_;
};

/// A computed policy that uses only the angles and velocities of an observation, not energy and
/// height.
class PendulumController : public ComputedPolicy {
 public:
  using ComputedPolicy::ComputedPolicy;

  std::unique_ptr<Memory> Start(int num_envs) const override;
  void Act(Matrix<const float> obs, Matrix<double> action, Memory& memory) const override;

 private:
  /// The torque (N·m) at a deviation from upright, for environment `env` of `memory`. The caller
  /// cuts it at the motor's limit.
  virtual double Torque(const StateVector& deviation, size_t env, Memory& memory) const = 0;
};

/// Collects the settings of several structs.
template <typename First, typename... Others>
Options OptionsOfAll(const First& first, const Others&... others) {
  Options options = OptionsOf(first);
  (options.AddMissing(OptionsOf(others)), ...);
  return options;
}

}  // namespace upswing
