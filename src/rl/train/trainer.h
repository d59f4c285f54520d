#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <vector>

#include "base/env.h"
#include "base/steps.h"
#include "rl/agent.h"
#include "rl/train/evaluate.h"
#include "rl/train/train_config.h"
#include "rl/train/train_state.h"

namespace upswing {

/// The training loop, step by step. It uses no files and no terminal. The caller adds observers
/// that write, and saves the State.
class Trainer {
 public:
  /// The agent, the environments and the evaluator must outlive the trainer. `info` describes the
  /// policy; the trainer adds the step and the results of the evaluation.
  Trainer(const TrainConfig& config, Agent& agent, VectorEnv& env, Evaluator& evaluator,
          PolicyInfo info = {});
  Trainer(const Trainer&) = delete;
  Trainer& operator=(const Trainer&) = delete;

  /// Adds an observer, which is called after those added before. It must outlive the last call of
  /// Step, State and FinishEvaluation.
  void AddObserver(TrainObserver& observer) { observers_.push_back(&observer); }

  /// Makes one step of all environments, then the due work: updates, metrics, an evaluation.
  /// Returns false and does nothing once the training is finished. Throws Failure if a number is
  /// not finite.
  ///
  /// An evaluation that cannot end the training runs in the background, if the evaluator can do
  /// this. The next evaluation, the end and State wait for its result. Observers hear of later
  /// steps after it, so results and files are the same as if each evaluation interrupted the
  /// training.
  bool Step();

  /// Lets the training wait for each evaluation from now on. Then an observer hears of a step at
  /// that step, and can stop the training there.
  void WaitForEvaluations() { waits_ = true; }
  /// Waits for the evaluation in the background, if there is one, and takes its result. Throws what
  /// the evaluation has thrown.
  void FinishEvaluation();
  /// Finishes the evaluation after another failure. Drops its own exception, so that the first
  /// failure is reported.
  void FinishEvaluationQuietly();
  /// Whether an evaluation runs in the background.
  bool is_evaluating() const { return background_ != nullptr; }

  bool finished() const { return state_.Finished(config_); }
  /// Whether the last Step reached or passed a multiple of `every` steps.
  bool IsDue(int64_t every) const { return upswing::IsDue(before_, state_.steps, every); }

  const TrainState& state() const { return state_; }
  const TrainConfig& config() const { return config_; }

  /// Saves or loads the whole state of the agent, the environments and the training. Finishes the
  /// evaluation in the background first.
  void State(const Archive& archive);

 private:
  /// Does the work of a Step.
  void Advance();

  // Defined in trainer_evaluation.cc.

  /// An evaluation of the policy of a step, and its result.
  struct EvaluationTask;
  using Event = std::function<void(TrainObserver&, const TrainState&)>;

  /// Evaluates the current policy. An unscheduled final evaluation does not count towards `solved`.
  void Evaluate(bool scheduled);
  static bool HasEnded(const EvaluationTask& task);
  /// Starts the evaluation in the background. Returns whether the system has a thread for it.
  bool StartInBackground(const std::shared_ptr<EvaluationTask>& task);
  /// Runs the evaluation, and the stricter one if that is due.
  void Run(EvaluationTask& task);
  /// Takes the result of the evaluation and tells the observers.
  void TakeResult(EvaluationTask& task);
  /// Tells the observers of an event now, or after the evaluation in the background.
  void NotifyOrDefer(const Event& event);

  TrainConfig config_;
  PolicyInfo info_;
  std::vector<TrainObserver*> observers_;
  Agent& agent_;
  VectorEnv& env_;
  Evaluator& evaluator_;
  TrainState state_;
  StepResult result_;
  std::vector<double> action_;                  // (N × A), A components of an action
  int64_t before_ = 0;                          // steps before the last Step
  bool waits_ = false;                          // for each evaluation
  std::shared_ptr<EvaluationTask> background_;  // running evaluation; the destructor waits for it
};

}  // namespace upswing
