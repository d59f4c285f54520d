#pragma once

#include <array>

#include "base/options.h"
#include "pendulum/task.h"

namespace upswing {

/// Weights of the reward's terms; 0 leaves a term out.
struct RewardConfig {
  std::array<double, kRewardTerms> weight{1, 1, 1, 1, 1};

  /// Declares each setting in `options`: name, range, unit, help.
  void Describe(Options& options);
};

}  // namespace upswing
