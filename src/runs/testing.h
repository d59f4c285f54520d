#pragma once

#include <cstdint>
#include <string>
#include <utility>
#include <vector>

#include "runs/run_record.h"

/// Helpers for tests of comparisons.
namespace upswing {

/// A run of 8 environments with an evaluation every 1,000 steps, each 1,000 steps taking one
/// second. `evaluations` has the success rate and return of each evaluation.
inline RunRecord MadeRun(int64_t seed, const std::vector<std::pair<double, double>>& evaluations,
                         int64_t budget = 5000, bool stop_when_solved = true) {
  RunRecord run{"run" + std::to_string(seed), Config(), ""};
  TrainConfig& train = run.config.train;
  train.seed = seed;
  train.steps = budget;
  train.envs = 8;
  train.eval_every = 1000;
  train.stop_when_solved = stop_when_solved;
  for (const auto& [success, mean_return] : evaluations) {
    const auto k = static_cast<int64_t>(run.evaluations.size()) + 1;
    run.evaluations.push_back({1000 * k, static_cast<double>(k), success, mean_return});
  }
  return run;
}

}  // namespace upswing
