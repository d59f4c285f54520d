#pragma once

#include <memory>
#include <string>
#include <string_view>

#include "agents/config.h"
#include "base/tensors.h"
#include "base/thread_pool.h"
#include "rl/train/trainer.h"

namespace upswing {

/// Metadata "format" of a checkpoint.
inline constexpr std::string_view kCheckpointFormat = "upswing-checkpoint-1";

/// Whether evaluations run in the closed form and MuJoCo confirms the evaluations that solve the
/// task.
bool IsScreened(const Config& config);

/// Computer on which a training runs.
struct Host {
  const Engine* mujoco;  // null: only the closed form
  int64_t memory;        // free memory, bytes
  int threads = 1;
  ForeignMaker make_foreign = {};  // for trainings on a foreign task
};

/// A training: environments, agent and training loop, made from its settings. It writes no file;
/// TrainingRun does.
class Training {
 public:
  /// Throws BadInput if the training does not fit into the free memory, or if the host lacks an
  /// engine of the settings.
  Training(Config config, const Host& host);

  /// Adds an observer; see Trainer::AddObserver.
  void AddObserver(TrainObserver& observer) { trainer_.AddObserver(observer); }

  /// Replaces the agent's initial weights by those of a policy. Call it before the first Step.
  /// Throws BadInput that begins with `where` unless its network is that of the agent.
  void StartFrom(const Policy& policy, const std::string& where);
  /// Makes one step of all environments; see Trainer::Step.
  bool Step() { return trainer_.Step(); }
  /// Lets the training wait for each evaluation; see Trainer::WaitForEvaluations.
  void WaitForEvaluations() { trainer_.WaitForEvaluations(); }
  /// Takes the result of the last evaluation; see Trainer::FinishEvaluation.
  void FinishEvaluation() { trainer_.FinishEvaluation(); }
  /// Takes it after another failure; throws nothing.
  void FinishEvaluationQuietly() { trainer_.FinishEvaluationQuietly(); }
  const Trainer& trainer() const { return trainer_; }
  const TrainState& state() const { return trainer_.state(); }
  const Config& config() const { return config_; }
  const Agent& agent() const { return *agent_; }
  const VectorEnv& env() const { return *env_; }
  const EnvSpec& spec() const { return env_->spec(); }
  int threads() const { return pool_.threads(); }

  /// The current policy, without exploration.
  std::unique_ptr<Policy> policy() const;

  /// Saves or loads the whole state, without the settings.
  void State(const Archive& archive) { trainer_.State(archive); }

  /// The whole state with its settings. The tensors view the arrays: save them before the next
  /// Step.
  Tensors Checkpoint();
  /// Loads a checkpoint. Throws BadInput unless it is from this version and these settings.
  void Load(const Tensors& checkpoint);

 private:
  Config config_;
  ThreadPool pool_;
  std::unique_ptr<VectorEnv> env_;
  std::unique_ptr<Agent> agent_;
  std::unique_ptr<Evaluator> evaluator_;
  Trainer trainer_;
};

}  // namespace upswing
