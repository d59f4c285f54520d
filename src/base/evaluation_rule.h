#pragma once

#include <utility>

namespace upswing {

/// Rule by which a task judges episodes and counts as solved. This is the only definition of
/// success, passed and solved.
struct EvaluationRule {
  double seconds = 0;  // length of an evaluation episode, s; a termination ends it earlier
  /// The return is Σ return_weight · reward over this first part of an episode, s.
  double return_seconds = 0;
  // An episode succeeds if it is at the goal for the last `hold_seconds` of the episode. If
  // `hold_seconds` is 0, an episode succeeds if its return is at least `solved_return`.
  double hold_seconds = 0;
  double solved_return = 0;
  /// The control period over the usual one, so that returns at different periods are comparable.
  double return_weight = 1;

  bool by_return() const { return hold_seconds == 0; }
  /// Whether an evaluation with this success rate and mean return is passed. By return, the mean
  /// return must be at least `solved_return`; otherwise all episodes must succeed. Two passed
  /// evaluations in a row solve the task.
  bool Passed(double success_rate, double mean_return) const {
    return by_return() ? mean_return >= solved_return : success_rate == 1;
  }
  /// Score for comparing two evaluations: the better evaluation has the larger score.
  std::pair<double, double> Score(double success_rate, double mean_return) const {
    return {by_return() ? 0 : success_rate, mean_return};
  }
};

}  // namespace upswing
