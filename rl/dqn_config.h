#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "core/options.h"
#include "nn/q_network.h"

namespace upswing {

/// Settings of the agent.
struct DqnConfig {
  std::vector<int64_t> hidden;
  int64_t head;
  bool layer_norm, double_q, dueling;
  int64_t levels;
  std::string precision;
  double gamma;
  int64_t n_step;
  double reward_scale;
  int64_t batch, replay, learning_starts;
  bool prioritized;
  double priority_exponent, importance_exponent;
  bool mirror;
  double updates_per_step;
  double learning_rate, learning_rate_end;
  int64_t learning_rate_steps;
  double max_gradient_norm;
  double tau;
  int64_t target_period;
  double policy_tau;
  double epsilon_start, epsilon_end, epsilon_decay;

  DqnConfig() { SetDefaults(*this); }
  /// One line per setting: name, default, range, unit, help.
  void Describe(Options& options);

  /// The shape of the network, for observations of `obs_size` numbers and so many actions.
  QNetworkShape Shape(int obs_size, int actions) const;
};

}  // namespace upswing
