#pragma once

#include <memory>
#include <vector>

#include "core/tensors.h"
#include "core/thread_pool.h"
#include "rl/trainer.h"
#include "setup/config.h"

namespace upswing {

/// The environments of the evaluation at a step of a training with these settings: an episode in
/// each. The engine is the training's.
EnvConfig EvaluationEnvironments(const Config& config, int64_t step);

/// Whether evaluations are in the closed form, and MuJoCo confirms what solves the task. With the
/// same setting a model of your own, which has no closed form, is evaluated in MuJoCo.
bool IsScreened(const Config& config);

/// What a training finds on its computer.
struct Host {
  Engines engines;
  int64_t memory;  // bytes that are free
  int threads = 1;
};

/// A training made of its settings: environments, agent and training loop. It writes no file; see
/// TrainingRun.
class Training {
 public:
  /// Throws BadInput if it would not fit into the free memory, or if the host lacks an engine of
  /// the settings.
  Training(Config config, const Host& host);

  /// Calls this observer from now on; see Trainer::AddObserver.
  void AddObserver(TrainObserver& observer) { trainer_.AddObserver(observer); }

  /// One step of all environments; see Trainer::Step.
  bool Step() { return trainer_.Step(); }
  const Trainer& trainer() const { return trainer_; }
  const TrainState& state() const { return trainer_.state(); }
  const Config& config() const { return config_; }
  const Agent& agent() const { return *agent_; }
  const EnvSpec& spec() const { return env_->spec(); }
  int threads() const { return pool_.threads(); }

  /// The policy as it stands, without exploration.
  std::unique_ptr<Policy> policy() const;

  /// Saves or loads the whole state, without the settings.
  void State(const Archive& archive) { trainer_.State(archive); }

  /// The whole state, with the settings that it belongs to. Views the arrays: to be saved before
  /// the next Step.
  Tensors Checkpoint();
  /// Throws BadInput unless the checkpoint is one of this version and of these settings.
  void Load(const Tensors& checkpoint);

 private:
  TrainSetup MakeSetup(const Engines& engines);
  /// Evaluation of a policy from fresh starts with the reward's standard weights, on the training
  /// plant or, where plants are random, on a fresh one for each episode; disturbed as in training.
  Evaluation Evaluate(const Engine& engine, const Policy& policy, int64_t step);

  Config config_;
  ThreadPool pool_;
  std::unique_ptr<VectorEnv> env_;
  std::unique_ptr<Agent> agent_;
  Trainer trainer_;
};

}  // namespace upswing
