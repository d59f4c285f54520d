#pragma once

#include <cstdint>
#include <vector>

#include "core/options.h"
#include "nn/mlp.h"
#include "rl/off_policy.h"

namespace upswing {

/// Settings of the agent; see rl/sac.h.
struct SacConfig : OffPolicyConfig {
  std::vector<int64_t> hidden = {256, 256};
  bool layer_norm = true;
  int64_t bins = 0;
  double value_low = -10, value_high = 60;
  bool twin = true;
  double smoothness = 0;
  int64_t actor_period = 2;
  double actor_rate = 1;
  double tau = 0.02;
  double policy_tau = 0.01;
  bool tune_alpha = true;
  double alpha = 0.1, alpha_rate = 3e-3, target_entropy = -1;

  /// One line per setting: name, range, unit, help.
  void Describe(Options& options);

  /// The trunk of a network of so many inputs.
  MlpShape Trunk(int inputs) const;
};

}  // namespace upswing
