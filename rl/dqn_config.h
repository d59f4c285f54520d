#pragma once

#include <cstdint>
#include <vector>

#include "core/options.h"
#include "nn/q_network.h"
#include "rl/off_policy.h"

namespace upswing {

/// Settings of the agent.
struct DqnConfig : OffPolicyConfig {
  std::vector<int64_t> hidden;
  int64_t head;
  bool layer_norm, double_q, dueling;
  int64_t levels;
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
