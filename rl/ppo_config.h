#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "core/options.h"
#include "nn/mlp.h"

namespace upswing {

/// Settings of proximal policy optimisation.
struct PpoConfig {
  std::vector<int64_t> hidden;
  std::string activation;
  bool layer_norm;
  std::string actions;
  int64_t levels;
  double gamma, lambda;
  double reward_scale;
  int64_t horizon, epochs, batch;
  double clip, value_clip;
  double entropy_bonus, entropy_bonus_end;
  double initial_std, max_std;
  bool normalize, mirror;
  double learning_rate, learning_rate_end;
  int64_t learning_rate_steps;
  double kl_target;
  double max_gradient_norm;

  PpoConfig() { SetDefaults(*this); }
  /// One line per setting: name, default, range, unit, help.
  void Describe(Options& options);

  /// Whether actions are levels, not continuous.
  bool discrete() const { return actions == "levels"; }
  /// The shape of actor and critic, for observations of `obs_size` numbers.
  MlpShape Shape(int obs_size) const;
  /// Throws BadInput unless minibatches divide a rollout of so many environments, of at most
  /// 10,000,000 steps.
  void CheckBatch(int64_t num_envs) const;
};

}  // namespace upswing
