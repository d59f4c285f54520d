#pragma once

#include <cstdint>
#include <string>
#include <utility>
#include <vector>

/// What tests of comparisons share.
namespace upswing {

/// A run of 8 environments with an evaluation every 1,000 steps, each of which took a second; one
/// evaluation for each pair of success rate and return.
inline RunRecord MadeRun(int64_t seed, const std::vector<std::pair<double, double>>& evaluations,
                         int64_t budget = 5000, bool stop_when_solved = true) {
  constexpr EvaluationRule kRule{20, 10, 10, 0};  // by success
  RunRecord run{"run" + std::to_string(seed), seed, budget, 8, 1000, stop_when_solved, kRule};
  for (const auto& [success, mean_return] : evaluations) {
    const auto k = static_cast<int64_t>(run.evaluations.size()) + 1;
    run.evaluations.push_back({1000 * k, static_cast<double>(k), success, mean_return});
  }
  return run;
}

}  // namespace upswing
