#pragma once

#include <utility>

namespace upswing {

/// How a task judges episodes, and when it counts as solved: the one place for what these words
/// mean.
struct EvaluationRule {
  double seconds = 0;         // length of an evaluation episode, unless it terminates earlier
  double return_seconds = 0;  // the return is the undiscounted reward of the first so many
  // An episode succeeds if it is at the goal throughout the last so many seconds, or, where that is
  // 0, if its return is at least `solved_return`.
  double hold_seconds = 0;
  double solved_return = 0;

  bool by_return() const { return hold_seconds == 0; }
  /// Whether an evaluation with this share of successes and this mean return is passed: all
  /// episodes succeed, or the mean return is at least `solved_return`. Two passed ones in a row
  /// solve the task.
  bool Passed(double success_rate, double mean_return) const {
    return by_return() ? mean_return >= solved_return : success_rate == 1;
  }
  /// The better of two evaluations has the larger score.
  std::pair<double, double> Score(double success_rate, double mean_return) const {
    return {by_return() ? 0 : success_rate, mean_return};
  }
};

}  // namespace upswing
