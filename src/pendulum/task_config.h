#pragma once

#include <array>
#include <string>

#include "base/env.h"
#include "base/options.h"
#include "pendulum/task.h"

namespace upswing {

/// The reward: the weights of the built-in terms, 0 leaves a term out; or an expression of your own
/// in their place (see OwnReward).
struct RewardConfig {
  std::array<double, kRewardTerms> weight{1, 1, 1, 1, 1};
  std::string expression;  // empty: the built-in terms

  /// Writes the terms of an environment, weighted, and their sum.
  void Weigh(int env, const std::array<double, kRewardTerms>& terms, StepResult& result) const;

  /// Declares each setting in `options`: name, range, unit, help.
  void Describe(Options& options);
};

}  // namespace upswing
