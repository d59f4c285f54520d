#include "agents/training.h"

#include <optional>
#include <utility>

#include "agents/config_checks.h"
#include "agents/loaded_policy.h"
#include "base/error.h"
#include "base/text.h"
#include "nn/network_policy.h"

namespace upswing {
namespace {

/// Returns the settings if there is enough memory for the training. Throws BadInput otherwise.
Config Checked(Config config, const Host& host) {
  CheckMemory(config, host.memory);
  return config;
}

/// The engine of this name, a setting. Throws BadInput that begins with `where`.
const Engine& EngineOf(const Host& host, const std::string& name, const std::string& where) {
  if (name == kClosedForm.name) return kClosedForm;
  if (host.mujoco != nullptr) return *host.mujoco;
  throw BadInput(
      Concat(where, ": expected ", kClosedForm.name, ", the only engine here, got ", name));
}

/// Makes the environments of the settings. The threads of the pool share their work.
std::unique_ptr<VectorEnv> MakeTrainingEnv(const Config& config, const Host& host,
                                           ThreadPool& pool) {
  EnvConfig env = config.Environments();
  env.engine = &EngineOf(host, config.physics, "--physics");
  env.make_foreign = host.make_foreign;
  env.pool = &pool;
  return MakeEnv(env);
}

/// Evaluates policies from new start states with the reward's standard weights, with the
/// disturbances of the training. Plants are the training plant, or a new random plant per episode
/// if training randomizes plants. An evaluation in the background has half of the threads.
class TrainingEvaluator : public Evaluator {
 public:
  /// The settings and the training's pool must outlive the evaluator.
  TrainingEvaluator(const Config& config, const Host& host, ThreadPool& pool)
      : config_(config),
        make_foreign_(host.make_foreign),
        training_pool_(pool),
        own_pool_(pool.threads() / 2, pool.adapts()) {
    const bool screened = config.eval_physics == kScreened;
    engine_ = &EngineOf(host, screened ? kMuJoCoName : config.eval_physics, "--eval-physics");
  }

  bool CanRunInBackground() const override {
    return training_pool_.threads() > 1 && !config_.is_foreign();
  }
  void ShareThreads(bool shared) override {
    training_pool_.Lend(shared ? own_pool_.threads() : 0);
    pool_ = shared ? &own_pool_ : &training_pool_;
  }
  Evaluation Evaluate(const Policy& policy, int64_t step) override {
    return EvaluateIn(IsScreened(config_) ? kClosedForm : *engine_, policy, step);
  }
  std::optional<Evaluation> Confirm(const Policy& policy, int64_t step) override {
    if (!IsScreened(config_)) return std::nullopt;
    return EvaluateIn(*engine_, policy, step);
  }

 private:
  Evaluation EvaluateIn(const Engine& engine, const Policy& policy, int64_t step) const {
    EnvConfig env = config_.Environments();
    env.num_envs = env.evaluations;  // one per episode
    env.episode_seconds = SpecOf(env).evaluation.seconds;
    env.start = StartStates();
    env.reward = RewardConfig();
    env.stream = Concat("evaluation at step ", step);
    env.for_evaluation = true;
    env.pool = pool_;
    env.engine = &engine;
    env.make_foreign = make_foreign_;
    return upswing::Evaluate(policy, *MakeEnv(env), pool_);
  }

  const Config& config_;
  ForeignMaker make_foreign_;
  ThreadPool& training_pool_;
  ThreadPool own_pool_;
  ThreadPool* pool_ = &training_pool_;  // of the next evaluation
  const Engine* engine_;                // of Evaluate, or of Confirm if evaluations are screened
};

}  // namespace

bool IsScreened(const Config& config) {
  return config.eval_physics == kScreened && !config.is_foreign();
}

Training::Training(Config config, const Host& host)
    : config_(Checked(std::move(config), host)),
      pool_(host.threads, config_.train.threads == 0),
      env_(MakeTrainingEnv(config_, host, pool_)),
      agent_(config_.MakeAgent(env_->spec(), pool_)),
      evaluator_(std::make_unique<TrainingEvaluator>(config_, host, pool_)),
      trainer_(config_.train, *agent_, *env_, *evaluator_, InfoOf(config_)) {}

void Training::StartFrom(const Policy& policy, const std::string& where) {
  const auto* network = dynamic_cast<const NetworkPolicy*>(&policy);
  const std::string got =
      network ? Concat(network->parts().facts().name, " ", network->parts().shape.Text())
              : policy.kind();
  if (network && agent_->StartFrom(network->parts())) return;
  const std::unique_ptr<NetworkPolicy> own = agent_->ExportPolicy({});
  throw BadInput(Concat(where, ": expected a policy with the network of the agent, ",
                        own->parts().facts().name, " ", own->parts().shape.Text(), ", got ", got));
}

std::unique_ptr<Policy> Training::policy() const {
  PolicyInfo info = InfoOf(config_);
  info.step = state().steps;
  return agent_->ExportPolicy(std::move(info));
}

Tensors Training::Checkpoint() {
  Tensors checkpoint;
  checkpoint.metadata = {{"format", std::string(kCheckpointFormat)},
                         {"upswing_version", UPSWING_VERSION},
                         {"config", ConfigToml(config_, true)}};
  State(Archive::Saver(checkpoint));
  return checkpoint;
}

void Training::Load(const Tensors& checkpoint) {
  checkpoint.ExpectMetadata("format", kCheckpointFormat);
  checkpoint.ExpectMetadata("upswing_version", UPSWING_VERSION);
  const Config old_config = ConfigIn(checkpoint.Metadata("config"), checkpoint.where());
  ExpectSameSettings(old_config, config_, checkpoint.where(),
                     [](const Option& option) { return option.identity(); });
  State(Archive::Loader(checkpoint));
}

}  // namespace upswing
