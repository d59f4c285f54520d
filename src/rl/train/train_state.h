#pragma once

#include <cstdint>
#include <optional>
#include <vector>

#include "base/archive.h"
#include "base/env.h"
#include "base/policy.h"
#include "rl/agent.h"
#include "rl/train/evaluate.h"
#include "rl/train/train_config.h"

namespace upswing {

/// A training episode that has ended.
struct FinishedEpisode {
  double reward_sum = 0;      // undiscounted return
  int64_t length = 0;         // steps
  bool terminated = false;    // otherwise it ran out of time
  std::vector<double> terms;  // (K) sum of each reward term
};

/// The part of a training's progress that its evaluations change.
struct EvaluationState {
  int64_t streak = 0;         // passed evaluations in a row, until solved
  int64_t streak_step = 0;    // step of the streak's first evaluation
  double streak_seconds = 0;  // training time at streak_step; the time to solve, once solved
  bool solved = false;        // two passed evaluations in a row
  double last_success_rate = 0;
  double best_success_rate = -1, best_return = 0;
  int64_t best_step = 0;
};

/// Progress of a training, without the agent and the environments. N environments, K reward terms.
struct TrainState : EvaluationState {
  int64_t steps = 0, episodes = 0;
  double seconds = 0;  // training time without evaluations that the training waits for
  std::vector<double> episode_return, episode_terms;  // (N), (N × K) of the running episodes
  std::vector<int64_t> episode_length;                // (N) steps
  std::vector<double> recent_returns;                 // of up to 100 last episodes, newest last

  TrainState(int num_envs, int num_terms);
  /// A copy that has no running episodes, which take most of the memory.
  TrainState WithoutEpisodes() const;
  /// Takes what the evaluations of another state have changed.
  void TakeEvaluations(const EvaluationState& other) {
    static_cast<EvaluationState&>(*this) = other;
  }
  double mean_return() const;
  /// Whether a training with these settings is finished: the steps are used up, or the task is
  /// solved and stop_when_solved is set.
  bool Finished(const TrainConfig& config) const;
  /// Adds the step of environment `env` to its running episode. Returns the episode if it has
  /// ended.
  std::optional<FinishedEpisode> AddStep(const StepResult& result, size_t env);
  /// Forgets the running episodes.
  void DropEpisodes();
  /// Whether the policy of this evaluation is better than the best so far, by the task's rule.
  bool IsBest(const Evaluation& e, const EvaluationRule& rule) const;
  /// Counts passed evaluations in a row. Two of them solve the task.
  void CountStreak(const Evaluation& e);
  void State(const Archive& archive);
};

/// Observer of a training. The Trainer calls it in the order of the steps, with states that have no
/// running episodes: events after an evaluation in the background wait for its result.
class TrainObserver {
 public:
  virtual ~TrainObserver() = default;
  virtual void OnEpisode(const TrainState&, const FinishedEpisode&) {}
  /// Receives the agent's metrics of the last log_every steps.
  virtual void OnMetrics(const TrainState&, const Metrics&) {}
  /// Called before a call of Evaluator::Confirm that interrupts the training, maybe for seconds.
  virtual void OnConfirm(const TrainState&) {}
  virtual void OnEvaluation(const TrainState&, const Evaluation&) {}
  /// Receives the best policy so far. OnEvaluation follows with its evaluation.
  virtual void OnBest(const TrainState&, const Policy&) {}
};

}  // namespace upswing
