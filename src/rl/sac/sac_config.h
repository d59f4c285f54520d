#pragma once

#include <cstdint>
#include <vector>

#include "nn/network.h"
#include "rl/agent_config.h"
#include "rl/off_policy_config.h"

namespace upswing {

/// Settings of the SAC agent; see rl/sac/sac.h.
struct SacConfig : AgentConfig {
  OffPolicyConfig off_policy = {.reward_centering = 0};
  std::vector<int64_t> hidden = {256, 256};
  bool layer_norm = true;
  bool twin = true;
  double smoothness = 0;
  int64_t actor_period = 2;
  double actor_rate = 1;
  double tau = 0.02;
  double policy_tau = 0.01;
  bool entropy_reward = true;
  bool tune_alpha = true;
  double alpha = 0.1, alpha_rate = 3e-3, target_entropy = -1;

  void Describe(Options& options) override;
  void Check(int64_t num_envs) const override;
  bool FitToActions(int64_t choices) override;
  AgentSize Size(const EnvSpec& spec) const override;
  std::string Text() const override;
  std::vector<std::string> Warnings(int64_t steps, int64_t num_envs) const override;
  bool HasSoftValues() const override { return entropy_reward; }

  /// The shape of a network with `inputs` inputs and `outputs` outputs.
  NetworkShape Shape(int inputs, int outputs) const;
};

}  // namespace upswing
