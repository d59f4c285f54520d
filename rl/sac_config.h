#pragma once

#include <cstdint>
#include <vector>

#include "core/options.h"
#include "nn/mlp.h"

namespace upswing {

/// Settings of the agent; see rl/sac.h.
struct SacConfig {
  std::vector<int64_t> hidden;
  bool layer_norm;
  int64_t bins;
  double value_low, value_high;
  bool twin;
  double gamma;
  int64_t n_step;
  double reward_scale;
  double smoothness;
  int64_t batch, replay, learning_starts;
  bool mirror;
  double updates_per_step;
  int64_t actor_period;
  double learning_rate, learning_rate_end;
  int64_t learning_rate_steps;
  double max_gradient_norm;
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
