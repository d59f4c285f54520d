// Evaluations of a training: confirmed ones, the best policy, and when the task is solved.
#include <memory>
#include <optional>

#include "nn/network_policy.h"
#include "rl/train/trainer.h"

namespace upswing {

void Trainer::Evaluate(bool scheduled) {
  TrainState& s = state_;
  info_.step = s.steps;
  const std::unique_ptr<NetworkPolicy> policy = agent_.ExportPolicy(info_);
  Evaluation e = evaluator_.Evaluate(*policy, s.steps);

  // Confirm the second passed evaluation in a row, and once solved each that would be the best.
  const EvaluationRule& rule = env_.spec().evaluation;
  const bool is_second = scheduled && s.streak == 1;
  const bool may_count = s.solved ? s.IsBest(e, rule) : is_second;
  std::optional<Evaluation> confirmed;
  if (e.passed && may_count) {
    for (TrainObserver* observer : observers_) observer->OnConfirm(s);
    confirmed = evaluator_.Confirm(*policy, s.steps);
    if (confirmed) e = *confirmed;
  }
  s.last_success_rate = e.success_rate();

  // Before the task is solved, the best result comes from the milder evaluation. A confirmed policy
  // then replaces it without comparison.
  if (s.IsBest(e, rule) || (confirmed && !s.solved)) {
    policy->SetResult(e.success_rate(), e.reward_sum.mean);
    for (TrainObserver* observer : observers_) observer->OnBest(s, *policy);
    s.best_success_rate = e.success_rate();
    s.best_return = e.reward_sum.mean;
    s.best_step = s.steps;
  }
  if (scheduled) s.CountStreak(e);
  for (TrainObserver* observer : observers_) observer->OnEvaluation(s, e);
}

}  // namespace upswing
