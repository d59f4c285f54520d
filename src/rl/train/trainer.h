#pragma once

#include <cstdint>
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

  /// Adds an observer, which is called after those added before. It must outlive the last Step.
  void AddObserver(TrainObserver& observer) { observers_.push_back(&observer); }

  /// Makes one step of all environments, then the due work: updates, metrics, an evaluation.
  /// Returns false and does nothing once the training is finished. Throws Failure if a number is
  /// not finite.
  bool Step();

  bool finished() const { return state_.Finished(config_); }
  /// Whether the last Step reached or passed a multiple of `every` steps.
  bool IsDue(int64_t every) const { return upswing::IsDue(before_, state_.steps, every); }

  const TrainState& state() const { return state_; }
  const TrainConfig& config() const { return config_; }

  /// Saves or loads the whole state of the agent, the environments and the training.
  void State(const Archive& archive);

 private:
  /// Evaluates the current policy (trainer_evaluation.cc). An unscheduled final evaluation does not
  /// count towards `solved`.
  void Evaluate(bool scheduled);

  TrainConfig config_;
  PolicyInfo info_;
  std::vector<TrainObserver*> observers_;
  Agent& agent_;
  VectorEnv& env_;
  Evaluator& evaluator_;
  TrainState state_;
  StepResult result_;
  std::vector<double> action_;  // (N × A), A components of an action
  int64_t before_ = 0;          // steps before the last Step
};

}  // namespace upswing
