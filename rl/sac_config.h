#pragma once

#include <cstdint>
#include <vector>

#include "core/options.h"
#include "nn/mlp.h"
#include "rl/off_policy.h"

namespace upswing {

/// Settings of the agent; see rl/sac.h.
struct SacConfig : OffPolicyConfig {
  std::vector<int64_t> hidden;
  bool layer_norm;
  int64_t bins;
  double value_low, value_high;
  bool twin;
  double smoothness;
  int64_t actor_period;
  double actor_rate;
  double tau;
  double policy_tau;
  bool tune_alpha;
  double alpha, alpha_rate, target_entropy;

  SacConfig() { SetDefaults(*this); }
  /// One line per setting: name, default, range, unit, help.
  void Describe(Options& options);

  /// The trunk of a network of so many inputs.
  MlpShape Trunk(int inputs) const;
};

}  // namespace upswing
