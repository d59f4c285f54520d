#pragma once

#include <cstdint>
#include <vector>

#include "nn/network.h"
#include "rl/agent_config.h"
#include "rl/off_policy_config.h"

namespace upswing {

/// Settings of the DQN agent.
struct DqnConfig : AgentConfig {
  OffPolicyConfig off_policy = {.n_step = 5,
                                .priority_exponent = 0.7,
                                .importance_exponent = 0.2,
                                .updates_per_step = 0.04,
                                .learning_rate_steps = 350000};
  std::vector<int64_t> hidden = {256, 256};
  int64_t head = 128;
  bool layer_norm = true, double_q = true, dueling = true;
  int64_t levels = 9;
  double tau = 0.025;
  int64_t target_period = 0;
  double policy_tau = 0.022;
  double epsilon_start = 1.0, epsilon_end = 0.05, epsilon_decay = 0.977;

  void Describe(Options& options) override;
  void Check(int64_t num_envs) const override;
  bool FitToActions(int64_t choices) override;
  AgentSize Size(const EnvSpec& spec) const override;
  std::string Text() const override;
  std::vector<std::string> Warnings(int64_t steps, int64_t num_envs) const override;

  /// The shape of the network for observations of `obs_size` numbers and for `actions` actions.
  NetworkShape Shape(int obs_size, int actions) const;
};

}  // namespace upswing
