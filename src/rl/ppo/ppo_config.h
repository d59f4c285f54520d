#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "nn/network.h"
#include "rl/agent_config.h"

namespace upswing {

/// Settings of proximal policy optimisation.
struct PpoConfig : AgentConfig {
  std::vector<int64_t> hidden = {64, 64};
  std::string activation = "tanh";
  bool layer_norm = false;
  std::string actions = "continuous";
  int64_t levels = 9;
  double gamma = 0.99, lambda = 0.95;
  double reward_scale = 0.1;
  int64_t horizon = 32, epochs = 4, batch = 256;
  double clip = 0.2, value_clip = 0;
  double entropy_bonus = 0, entropy_bonus_end = 0;
  double initial_std = 1, max_std = 5;
  bool normalize = true, mirror = false;
  double learning_rate = 1e-3, learning_rate_end = 1e-4;
  int64_t learning_rate_steps = 1000000;
  double kl_target = 0.01;
  double max_gradient_norm = 0.5;

  void Describe(Options& options) override;
  void Check(int64_t num_envs) const override;
  bool FitToActions(int64_t choices) override;
  bool StartsFromPolicy() const override { return false; }
  AgentSize Size(const EnvSpec& spec) const override;
  std::string Text() const override;
  std::vector<std::string> Warnings(int64_t steps, int64_t num_envs) const override;

  /// Whether actions are discrete levels.
  bool discrete() const { return actions == "levels"; }
  /// The shape of the actor or critic, for observations of `obs_size` numbers.
  NetworkShape Shape(int obs_size, int outputs) const;
};

}  // namespace upswing
