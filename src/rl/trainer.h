#pragma once

#include <cstdint>
#include <functional>
#include <span>
#include <vector>

#include "base/env.h"
#include "base/options.h"
#include "base/steps.h"
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
  /// Describes only the settings of the curriculum.
  void DescribeCurriculum(Options& options);

  /// Standard deviation of the start states' noise at a step (the curriculum). It changes linearly
  /// over curriculum_steps.
  double StartNoise(int64_t step) const;
};

/// Progress of a training, without the agent and the environments.
struct TrainState {
  int64_t steps = 0, episodes = 0;
  double seconds = 0;         // training time without evaluations
  int64_t streak = 0;         // passed evaluations in a row, until solved
  int64_t streak_step = 0;    // step of the streak's first evaluation
  double streak_seconds = 0;  // training time at streak_step; the time to solve, once solved
  bool solved = false;        // two passed evaluations in a row
  double last_success_rate = 0;
  double best_success_rate = -1, best_return = 0;
  int64_t best_step = 0;
  std::vector<double> episode_return, episode_terms;  // (N), (N × K) of the running episodes
  std::vector<int64_t> episode_length;                // (N) steps
  std::vector<double> recent_returns;                 // of up to 100 last episodes, newest last

  TrainState(int num_envs, int num_terms);
  double mean_return() const;
  /// Whether a training with these settings is finished: the steps are used up, or the task is
  /// solved and stop_when_solved is set.
  bool Finished(const TrainConfig& config) const;
  void State(const Archive& archive);
};

/// A training episode that has ended.
struct FinishedEpisode {
  double reward_sum = 0;          // undiscounted return
  int64_t length = 0;             // steps
  bool terminated = false;        // otherwise it ran out of time
  std::span<const double> terms;  // (K) sum of each reward term
};

/// Observer of a training. Trainer::Step calls it.
class TrainObserver {
 public:
  virtual ~TrainObserver() = default;
  virtual void OnEpisode(const TrainState&, const FinishedEpisode&) {}
  /// Receives the agent's metrics of the last log_every steps.
  virtual void OnMetrics(const TrainState&, const Metrics&) {}
  virtual void OnEvaluation(const TrainState&, const Evaluation&) {}
  /// Receives the best policy so far. OnEvaluation follows with its evaluation.
  virtual void OnBest(const TrainState&, const Policy&) {}
};

/// Parts of a training, except the agent and the environments.
struct TrainSetup {
  TrainConfig config;
  /// Evaluates the policy of a step. It uses new start states at each step.
  std::function<Evaluation(const Policy&, int64_t step)> evaluate = {};
  /// Description of the policy. The trainer adds the step and the results of the evaluation.
  PolicyInfo policy_info = {};
  /// Stricter and slower evaluation of a policy that passes `evaluate`; empty: none. Its result
  /// replaces the result of `evaluate`. Before the task counts as solved, it evaluates the second
  /// passed policy in a row. Afterwards it evaluates each policy that would become the best.
  std::function<Evaluation(const Policy&, int64_t step)> confirm = {};
};

/// The training loop, step by step. It uses no files and no terminal. The caller adds observers
/// that write, and saves the State.
class Trainer {
 public:
  /// The agent and the environments must outlive the trainer.
  Trainer(TrainSetup setup, Agent& agent, VectorEnv& env);

  /// Adds an observer, which is called after those added before. It must outlive the last Step.
  void AddObserver(TrainObserver& observer) { observers_.push_back(&observer); }

  /// Makes one step of all environments, then the due work: updates, metrics, an evaluation.
  /// Returns false and does nothing once the training is finished. Throws Failure if a number is
  /// not finite.
  bool Step();

  bool finished() const { return state_.Finished(setup_.config); }
  /// Whether something that is due at each multiple of `every` steps is due after the last Step.
  bool IsDue(int64_t every) const { return upswing::IsDue(before_, state_.steps, every); }

  const TrainState& state() const { return state_; }
  const TrainConfig& config() const { return setup_.config; }

  /// Saves or loads the whole state of the agent, the environments and the training.
  void State(const Archive& archive);

 private:
  /// Adds the step's result to the running episodes and reports the finished ones to the observers.
  void CountEpisodes();
  /// Evaluates the current policy. An unscheduled final evaluation does not count towards `solved`.
  void Evaluate(bool scheduled);
  bool IsBest(const Evaluation& e) const;
  void KeepAsBest(const Evaluation& e);
  /// Counts passed evaluations in a row. Two of them solve the task.
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
