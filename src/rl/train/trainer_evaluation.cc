// Evaluations of a training: confirmed ones, the best policy, when the task is solved, and
// evaluations in the background.
#include <exception>
#include <memory>
#include <optional>
#include <system_error>
#include <utility>

#include "base/thread_pool.h"
#include "nn/network_policy.h"
#include "rl/train/trainer.h"

namespace upswing {

struct Trainer::EvaluationTask {
  TrainState state;  // at the step of the policy
  std::unique_ptr<NetworkPolicy> policy;
  bool scheduled;
  bool training_waits;

  // The result.
  Evaluation evaluation = {};
  bool confirmed = false;

  /// An event of a later step, and the state then.
  struct DeferredEvent {
    TrainState state;
    Event event;
  };
  std::vector<DeferredEvent> deferred = {};
  std::unique_ptr<BackgroundTask> thread = {};  // the last member: it uses the others
};

void Trainer::Evaluate(bool scheduled) {
  FinishEvaluation();
  info_.step = state_.steps;
  // A result that may end the training is worth waiting for: steps beyond it would be lost.
  const bool may_solve = scheduled && state_.streak == 1 && config_.stop_when_solved;
  const bool is_last = state_.steps >= config_.steps;
  const bool training_waits = waits_ || may_solve || is_last || !evaluator_.CanRunInBackground();
  const auto task = std::make_shared<EvaluationTask>(EvaluationTask{
      state_.WithoutEpisodes(), agent_.ExportPolicy(info_), scheduled, training_waits});
  if (kHasThreads && !training_waits && StartInBackground(task)) return;
  task->training_waits = true;
  Run(*task);
  TakeResult(*task);
}

bool Trainer::StartInBackground(const std::shared_ptr<EvaluationTask>& task) {
  evaluator_.ShareThreads(true);
  try {
    task->thread =
        std::make_unique<BackgroundTask>([this, evaluated = task.get()] { Run(*evaluated); });
  } catch (const std::system_error&) {
    evaluator_.ShareThreads(false);
    return false;
  }
  background_ = task;
  return true;
}

void Trainer::Run(EvaluationTask& task) {
  const TrainState& s = task.state;
  task.evaluation = evaluator_.Evaluate(*task.policy, s.steps);

  // Confirm the second passed evaluation in a row, and once solved each that would be the best.
  const bool is_second = task.scheduled && s.streak == 1;
  const bool may_count = s.solved ? s.IsBest(task.evaluation, env_.spec().evaluation) : is_second;
  if (!task.evaluation.passed || !may_count) return;
  if (task.training_waits) {
    for (TrainObserver* observer : observers_) observer->OnConfirm(s);
  }
  if (const std::optional<Evaluation> stricter = evaluator_.Confirm(*task.policy, s.steps)) {
    task.evaluation = *stricter;
    task.confirmed = true;
  }
}

void Trainer::TakeResult(EvaluationTask& task) {
  TrainState& s = task.state;
  const Evaluation& e = task.evaluation;
  s.last_success_rate = e.success_rate();

  // Before the task is solved, the best result comes from the milder evaluation. A confirmed policy
  // then replaces it without comparison.
  if (s.IsBest(e, env_.spec().evaluation) || (task.confirmed && !s.solved)) {
    task.policy->SetResult(e.success_rate(), e.reward_sum.mean);
    for (TrainObserver* observer : observers_) observer->OnBest(s, *task.policy);
    s.best_success_rate = e.success_rate();
    s.best_return = e.reward_sum.mean;
    s.best_step = s.steps;
  }
  if (task.scheduled) s.CountStreak(e);
  state_.TakeEvaluations(s);
  for (TrainObserver* observer : observers_) observer->OnEvaluation(s, e);
}

bool Trainer::HasEnded(const EvaluationTask& task) { return task.thread->done(); }

void Trainer::FinishEvaluation() {
  if (!kHasThreads || !background_) return;
  const std::shared_ptr<EvaluationTask> task = std::move(background_);
  std::exception_ptr failure;
  try {
    task->thread->Wait();
  } catch (...) {
    failure = std::current_exception();
  }
  evaluator_.ShareThreads(false);
  if (failure) std::rethrow_exception(failure);

  TakeResult(*task);
  for (auto& [state, event] : task->deferred) {
    state.TakeEvaluations(state_);
    for (TrainObserver* observer : observers_) event(*observer, state);
  }
}

void Trainer::FinishEvaluationQuietly() {
  try {
    FinishEvaluation();
  } catch (...) {  // NOLINT(bugprone-empty-catch): the earlier failure is the cause
  }
}

void Trainer::NotifyOrDefer(const Event& event) {
  if (kHasThreads && background_) {
    background_->deferred.push_back({state_.WithoutEpisodes(), event});
    return;
  }
  for (TrainObserver* observer : observers_) event(*observer, state_);
}

}  // namespace upswing
