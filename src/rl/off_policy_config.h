#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "base/options.h"

namespace upswing {

/// Settings of all agents with a replay memory.
struct OffPolicyConfig {
  double gamma = 0.99;
  int64_t n_step = 3;
  double reward_scale = 0.1;
  int64_t batch = 128, replay = 300000;
  bool prioritized = true;
  double priority_exponent = 0.6, importance_exponent = 0.4;
  bool mirror = true;
  double reward_centering = 0.025;
  int64_t learning_starts = 2000;
  double updates_per_step = 0.0625;
  double learning_rate = 1e-3, learning_rate_end = 2e-5;
  int64_t learning_rate_steps = 250000;
  double max_gradient_norm = 10;

  // The parts of AgentConfig's functions that concern these settings.
  void Describe(Options& options);
  void Check() const;
  std::vector<std::string> Warnings(int64_t steps) const;
};

}  // namespace upswing
