#pragma once

#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <vector>

namespace upswing {

/// The contents of a policy's observations (docs/reference/policy-format.md).
struct ObservationInfo {
  std::vector<std::string> names;    // of the inputs, without those of the memory
  std::vector<double> max_velocity;  // rad/s, by which w1 and w2 are divided

  /// What identification of the plant adds to the inputs.
  struct Identified {
    std::vector<std::string> names;
    double scale = 0;  // by which the deviations of the constants are divided
    bool operator==(const Identified&) const = default;
  };
  std::optional<Identified> identified = {};

  /// Past steps that are part of an observation.
  struct Memory {
    int64_t steps = 0;
    std::vector<std::string> names;   // of the numbers of each step
    double velocity = 0, torque = 0;  // rad/s, N·m, by which changes and torques are divided
    bool operator==(const Memory&) const = default;
  };
  std::optional<Memory> memory;
};

/// The metadata of a policy's file, with their types and within their ranges; optional ones that
/// are missing are empty. Only this pair of files knows the metadata's keys and texts.
struct PolicyInfo {
  // How it was made.
  std::string agent;            // name of the agent, at most 64 characters
  std::string upswing_version;  // such as 0.3.0; empty: another program wrote it
  std::string config;           // the settings, as TOML
  std::optional<int64_t> seed, step;
  std::optional<double> success_rate;  // of the evaluation that it was kept for, in [0, 1]
  std::optional<double> mean_return;   // and its mean return

  // What for.
  std::string task;                      // its name; empty in older files: the double pendulum
  std::map<std::string, double> plant;   // its parameters at training
  std::optional<double> control_period;  // s, for which a torque is held
  std::optional<ObservationInfo> observation;
  std::string model;  // the MJCF, where it is not the built-in one

  // What a Q-value estimates: the sum of gamma^k · reward_scale · reward.
  std::optional<double> gamma, reward_scale;
};

/// Reads and checks the metadata of a policy's file. Throws BadInput that begins with `where`.
PolicyInfo ParsePolicyInfo(const std::map<std::string, std::string>& metadata,
                           const std::string& where);

/// The metadata from which ParsePolicyInfo makes `info`.
std::map<std::string, std::string> PolicyMetadata(const PolicyInfo& info);

}  // namespace upswing
