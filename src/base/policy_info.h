#pragma once

#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <vector>

namespace upswing {

/// Contents of a policy's observations (docs/reference/policy-format.md).
struct ObservationInfo {
  std::vector<std::string> names;    // names of the inputs, without the inputs of the memory
  std::vector<double> max_velocity;  // rad/s; w1 and w2 are divided by it

  /// Inputs that the identification of the plant adds.
  struct Identified {
    std::vector<std::string> names;
    double scale = 0;  // the deviations of the constants are divided by it
    bool operator==(const Identified&) const = default;
  };
  std::optional<Identified> identified = {};
  std::vector<std::string> goal = {};  // names of the inputs with the pose to reach; empty: none

  /// Past steps in an observation.
  struct PastSteps {
    int64_t steps = 0;
    std::vector<std::string> names;   // names of the numbers of each step
    double velocity = 0, torque = 0;  // rad/s, N·m; changes and torques are divided by them
    bool operator==(const PastSteps&) const = default;
  };
  std::optional<PastSteps> memory = {};
};

/// The metadata of a policy file, with types and checked ranges. Missing optional metadata are
/// empty. Only policy_info.h and policy_info.cc know the keys and texts of the metadata.
struct PolicyInfo {
  // Origin of the policy.
  std::string agent;            // name of the agent, at most 64 characters
  std::string upswing_version;  // such as 0.3.0; empty if another program wrote the file
  std::string config;           // settings of the training, as TOML
  std::optional<int64_t> seed, step;
  std::optional<double> success_rate;  // in [0, 1], of the evaluation for which the policy was kept
  std::optional<double> mean_return;   // mean return of that evaluation

  // Purpose of the policy.
  std::string task;  // name of the task; empty in older files, which are for the double pendulum
  std::map<std::string, double> plant;   // parameters of the plant in training
  std::optional<double> control_period;  // s, for which a torque is held
  std::optional<ObservationInfo> observation;
  // Natural units of the task, as multiples of those of the built-in double pendulum (Scale).
  double time_scale = 1, torque_scale = 1;

  // A Q-value estimates the sum of gamma^k · reward_scale · reward.
  std::optional<double> gamma, reward_scale;
};

/// Reads and checks the metadata of a policy file. Throws BadInput, whose message begins with
/// `where`.
PolicyInfo ParsePolicyInfo(const std::map<std::string, std::string>& metadata,
                           const std::string& where);

/// Metadata from which ParsePolicyInfo makes `info`.
std::map<std::string, std::string> PolicyMetadata(const PolicyInfo& info);

}  // namespace upswing
