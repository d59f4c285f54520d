#include "agents/training.h"

#include <utility>

#include "agents/config_checks.h"
#include "agents/loaded_policy.h"
#include "base/error.h"
#include "base/text.h"

namespace upswing {
namespace {

constexpr std::string_view kCheckpointFormat = "upswing-checkpoint-1";

/// Returns the settings if there is enough memory for the training. Throws BadInput otherwise.
Config Checked(Config config, const Host& host) {
  CheckMemory(config, host.memory);
  return config;
}

/// Makes the environments of the settings. The threads of the pool share their work.
std::unique_ptr<VectorEnv> MakeTrainingEnv(const Config& config, const Host& host,
                                           ThreadPool& pool) {
  EnvConfig env = config.Environments();
  env.engine = &FindEngine(host.engines, config.physics, "--physics");
  env.make_foreign = host.make_foreign;
  env.pool = &pool;
  return MakeEnv(env);
}

}  // namespace

bool IsScreened(const Config& config) {
  return config.eval_physics == kScreened && config.mjcf.empty() && !config.is_foreign();
}

EnvConfig EvaluationEnvironments(const Config& config, int64_t step) {
  EnvConfig env = config.Environments();
  env.num_envs = static_cast<int>(config.train.eval_episodes);
  env.episode_seconds = SpecOf(env).evaluation.seconds;
  env.start = StartStates();
  env.weights = RewardWeights();
  env.stream = Concat("evaluation at step ", step);
  env.for_evaluation = true;
  return env;
}

Training::Training(Config config, const Host& host)
    : config_(Checked(std::move(config), host)),
      make_foreign_(host.make_foreign),
      pool_(host.threads, config_.train.threads == 0),
      env_(MakeTrainingEnv(config_, host, pool_)),
      agent_(config_.MakeAgent(env_->spec(), pool_)),
      trainer_(MakeSetup(host.engines), *agent_, *env_) {}

TrainSetup Training::MakeSetup(const Engines& engines) {
  const auto judge_in = [this](const Engine& engine) {
    return [this, &engine](const Policy& policy, int64_t step) {
      return Evaluate(engine, policy, step);
    };
  };
  const std::string_view name =
      config_.eval_physics == kScreened ? kMuJoCoName : std::string_view(config_.eval_physics);
  const auto judge = judge_in(FindEngine(engines, name, "--eval-physics"));
  TrainSetup setup{.config = config_.train, .evaluate = judge, .policy_info = InfoOf(config_)};
  if (IsScreened(config_)) {
    setup.evaluate = judge_in(kClosedForm);
    setup.confirm = judge;
  }
  return setup;
}

std::unique_ptr<Policy> Training::policy() const {
  PolicyInfo info = InfoOf(config_);
  info.step = state().steps;
  return agent_->ExportPolicy(std::move(info));
}

Evaluation Training::Evaluate(const Engine& engine, const Policy& policy, int64_t step) {
  EnvConfig config = EvaluationEnvironments(config_, step);
  config.pool = &pool_;
  config.engine = &engine;
  config.make_foreign = make_foreign_;
  const std::unique_ptr<VectorEnv> env = MakeEnv(config);
  return upswing::Evaluate(policy, *env, &pool_);
}

Tensors Training::Checkpoint() {
  Tensors checkpoint;
  checkpoint.metadata = {{"format", std::string(kCheckpointFormat)},
                         {"upswing_version", UPSWING_VERSION},
                         {"config", ConfigToml(config_, true)},
                         {"model", config_.mjcf}};
  State(Archive::Saver(checkpoint));
  return checkpoint;
}

void Training::Load(const Tensors& checkpoint) {
  const auto expect = [&](const std::string& key, std::string_view expected) {
    const std::string& got = checkpoint.Metadata(key);
    if (got != expected) {
      throw BadInput(Concat(checkpoint.where(), ": ", key, ": expected \"", expected, "\", got \"",
                            got, "\""));
    }
  };
  expect("format", kCheckpointFormat);
  expect("upswing_version", UPSWING_VERSION);
  const Config old_config = ConfigIn(checkpoint.Metadata("config"), checkpoint.where());
  ExpectSameSettings(old_config, config_, checkpoint.where(),
                     [](const Option& option) { return option.identity(); });
  if (checkpoint.Metadata("model") != config_.mjcf) {
    throw BadInput(Concat(checkpoint.where(),
                          ": expected a checkpoint of the same model, got one of another than ",
                          config_.model));
  }
  State(Archive::Loader(checkpoint));
}

}  // namespace upswing
