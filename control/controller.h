#pragma once

#include <algorithm>
#include <memory>
#include <numbers>
#include <span>
#include <string>
#include <vector>

#include "control/pendulum_model.h"
#include "core/policy.h"
#include "sim/double_pendulum.h"

namespace upswing {

/// [q1 - π, q2, w1, w2], the angles in [-π, π], of a state and of what an observation of
/// sim/double_pendulum.h tells.
StateVector UprightDeviation(const StateVector& x);
StateVector UprightDeviation(std::span<const float> obs);

/// x - y, the angles in [-π, π].
StateVector Difference(const StateVector& x, const StateVector& y);

/// The state of a deviation from upright.
inline StateVector FromUpright(const StateVector& d) {
  return {std::numbers::pi + d[0], d[1], d[2], d[3]};
}

/// With four significant digits, such as 3.389.
std::string Rounded(double x);

/// A policy of the double pendulum that is computed from the equations of motion of one plant.
class ComputedPolicy : public Policy {
 public:
  std::string kind() const override { return info_.agent; }
  int obs_size() const override { return kObservationSize; }
  int action_size() const override { return 1; }
  const PolicyInfo& info() const override { return info_; }
  /// Throws BadInput: it is made anew each time.
  Tensors ToTensors() const override;

 protected:
  /// `settings`: how it was made.
  ComputedPolicy(const std::string& kind, const Options& settings, const Plant& plant);

  const Plant& plant() const { return plant_; }
  /// Of other observations than those without memory, for parts that see more of them.
  void SetObservation(const ObservationInfo& observation) { info_.observation = observation; }
  /// A torque (N·m) within the motor's limit.
  double Limited(double u) const {
    return std::clamp(u, -plant_.torque_limit, plant_.torque_limit);
  }

 private:
  Plant plant_;
  PolicyInfo info_;
};

/// One that sees the angles and velocities of an observation; energy and height do not matter to
/// it.
class PendulumController : public ComputedPolicy {
 public:
  using ComputedPolicy::ComputedPolicy;

  std::unique_ptr<Memory> Start(int num_envs) const override;
  void Act(Matrix<const float> obs, Matrix<double> action, Memory& memory) const override;

 private:
  /// The torque (N·m) at a deviation from upright of environment `env` of those of `memory`; what
  /// is beyond the motor's limit is cut.
  virtual double Torque(const StateVector& deviation, size_t env, Memory& memory) const = 0;
};

/// The settings of several structs together.
template <typename First, typename... Others>
Options OptionsOfAll(const First& first, const Others&... others) {
  Options options = OptionsOf(first);
  (options.AddMissing(OptionsOf(others)), ...);
  return options;
}

/// The Memory of a controller that remembers something of each environment.
template <typename Past>
struct MemoryOf : Policy::Memory {
  explicit MemoryOf(int num_envs, const Past& beginning)
      : past(static_cast<size_t>(num_envs), beginning) {}

  std::vector<Past> past;  // (N)
};

}  // namespace upswing
