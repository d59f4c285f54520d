#pragma once

#include <cstdint>
#include <functional>
#include <span>
#include <vector>

#include "core/env.h"
#include "core/options.h"
#include "core/steps.h"
#include "rl/agent.h"
#include "rl/evaluate.h"

namespace upswing {

/// Settings of the training loop. "Steps" are control steps, counted over all environments.
struct TrainConfig {
  int64_t steps = 1000000, envs = 32, seed = 1;
  int64_t eval_every = 10000, eval_episodes = 100, log_every = 2000, checkpoint_every = 50000;
  bool stop_when_solved = true;
  int64_t threads = 0;
  double start_noise = 0.1, start_noise_end = 0.1;
  int64_t curriculum_steps = 200000;

  /// One line per setting: name, range, unit, help.
  void Describe(Options& options);
  /// Those of them that are of the curriculum.
  void DescribeCurriculum(Options& options);

  /// The curriculum: noise of the start states, rising linearly over curriculum_steps.
  double StartNoise(int64_t step) const;
};

/// Where a training stands, apart from agent and environments.
struct TrainState {
  int64_t steps = 0, episodes = 0;
  double seconds = 0;         // of training, evaluations excluded
  int64_t streak = 0;         // passed evaluations in a row, until solved
  int64_t streak_step = 0;    // step of the streak's first
  double streak_seconds = 0;  // training time then: the time to solve, once solved
  bool solved = false;        // two passed evaluations in a row
  double last_success_rate = 0;
  double best_success_rate = -1, best_return = 0;
  int64_t best_step = 0;
  std::vector<double> episode_return, episode_terms;  // (N), (N × K) of the running episodes
  std::vector<int64_t> episode_length;                // (N) steps
  std::vector<double> recent_returns;                 // of the last episodes, newest last

  TrainState(int num_envs, int num_terms);
  double mean_return() const;
  /// Whether a training with these settings ends here: the task is solved, unless it is to go on
  /// then, or the steps are done.
  bool Finished(const TrainConfig& config) const;
  void State(const Archive& archive);
};

/// A training episode that has ended.
struct FinishedEpisode {
  double reward_sum = 0;          // its return, undiscounted
  int64_t length = 0;             // steps
  bool terminated = false;        // else it ran out of time
  std::span<const double> terms;  // (K) sum of each reward term
};

/// Who is told how a training goes on. Called within Trainer::Step.
class TrainObserver {
 public:
  virtual ~TrainObserver() = default;
  virtual void OnEpisode(const TrainState&, const FinishedEpisode&) {}
  /// The agent's metrics of the last log_every steps.
  virtual void OnMetrics(const TrainState&, const Metrics&) {}
  virtual void OnEvaluation(const TrainState&, const Evaluation&) {}
  /// The best policy so far, by its evaluation, which follows.
  virtual void OnBest(const TrainState&, const Policy&) {}
};

/// What a training is made of, apart from agent and environments.
struct TrainSetup {
  TrainConfig config;
  /// Evaluates the policy of a step from new start states, different ones at each step.
  std::function<Evaluation(const Policy&, int64_t step)> evaluate = {};
  /// Describes the policy, to which the step and the evaluation's results are added.
  PolicyInfo policy_info = {};
  /// A stricter and slower judge of a policy that `evaluate` passes; empty: none. Its evaluation
  /// counts in place of the other one. It judges the second passed policy in a row, before the task
  /// counts as solved, and afterwards each policy that would be the best one.
  std::function<Evaluation(const Policy&, int64_t step)> confirm = {};
};

/// The training loop, step by step. It knows neither files nor terminals: who drives it writes
/// what observers are told and saves the State.
class Trainer {
 public:
  /// The agent and the environments, which must outlive it.
  Trainer(TrainSetup setup, Agent& agent, VectorEnv& env);

  /// Calls this observer from now on, after those added before. It must outlive the last Step.
  void AddObserver(TrainObserver& observer) { observers_.push_back(&observer); }

  /// One step of all environments, then what is due: updates, metrics, an evaluation. False, with
  /// nothing done, once the training is finished. Throws Failure if a number is not finite.
  bool Step();

  bool finished() const { return state_.Finished(setup_.config); }
  /// Whether what is due at each multiple of `every` steps is due after the last Step.
  bool IsDue(int64_t every) const { return upswing::IsDue(before_, state_.steps, every); }

  const TrainState& state() const { return state_; }
  const TrainConfig& config() const { return setup_.config; }

  /// Saves or loads the whole state: of the agent, the environments and the training.
  void State(const Archive& archive);

 private:
  /// Adds the step's result to the running episodes and tells of those that it finished.
  void CountEpisodes();
  /// Evaluates the present policy. An unscheduled final evaluation does not count towards `solved`.
  void Evaluate(bool scheduled);
  bool IsBest(const Evaluation& e) const;
  void KeepAsBest(const Evaluation& e);
  /// Solved: two passed evaluations in a row.
  void CountStreak(const Evaluation& e);

  TrainSetup setup_;
  std::vector<TrainObserver*> observers_;
  Agent& agent_;
  VectorEnv& env_;
  TrainState state_;
  StepResult result_;
  std::vector<double> action_;  // (N × A)
  int64_t before_ = 0;          // steps before the last Step
};

}  // namespace upswing
