// Your own task, learned with only the layers base, nn and rl: Gymnasium's Pendulum-v1 and SAC.
//
//     own_task [sac|ppo] [SETTING=VALUE …]      such as own_task sac hidden=32,32 seed=2
#include <cstdio>
#include <cstdlib>
#include <memory>
#include <string>
#include <string_view>

#include "base/error.h"
#include "base/options.h"
#include "base/simd.h"
#include "base/thread_pool.h"
#include "pendulum_v1.h"
#include "rl/ppo/ppo.h"
#include "rl/sac/sac.h"
#include "rl/train/evaluate.h"
#include "rl/train/trainer.h"

using namespace upswing;

/// Evaluates policies on rods of their own.
class RodEvaluator : public Evaluator {
 public:
  explicit RodEvaluator(int rods) : rods_(rods) {}
  Evaluation Evaluate(const Policy& policy, int64_t step) override {
    PendulumV1 rods(rods_, /*seed=*/1000 + uint64_t(step));
    return upswing::Evaluate(policy, rods);
  }

 private:
  int rods_;
};

/// Prints a line for each evaluation.
class Printer : public TrainObserver {
  void OnEvaluation(const TrainState& s, const Evaluation& e) override {
    std::printf("%7d steps  %8.3f s  return %.1f\n", int(s.steps), s.seconds, e.reward_sum.mean);
  }
};

int main(int argc, char** argv) try {
  const std::string_view algorithm = argc > 1 ? argv[1] : "sac";
  if (algorithm != "sac" && algorithm != "ppo") throw BadInput("expected sac or ppo first");
  const bool is_ppo = algorithm == "ppo";
  // The fastest vector instructions of this processor, unless others are named: avx2, portable.
  if (const char* vectors = std::getenv("UPSWING_VECTORS")) UseSimdPath(vectors);

  TrainConfig train;
  train.envs = is_ppo ? 16 : 1;
  train.steps = is_ppo ? 500000 : 20000;
  train.eval_every = is_ppo ? 20000 : 2000;
  SacConfig sac;
  sac.hidden = {64, 64};
  sac.off_policy.batch = 100;
  sac.off_policy.learning_starts = 500;
  sac.off_policy.updates_per_step = 1;
  sac.off_policy.learning_rate_steps = 20000;
  sac.actor_period = 1;
  sac.tau = 0.01;
  PpoConfig ppo;
  ppo.gamma = 0.95;
  ppo.horizon = 128;
  ppo.epochs = 10;
  ppo.mirror = true;
  ppo.learning_rate_steps = 500000;

  // Settings have the names of the flags in `upswing train --help`.
  AgentConfig& learner = is_ppo ? static_cast<AgentConfig&>(ppo) : sac;
  Options settings;
  train.Describe(settings);
  learner.Describe(settings);
  for (int i = 2; i < argc; ++i) {
    const std::string text = argv[i];
    const size_t equals = text.find('=');
    if (equals == std::string::npos) throw BadInput(text + ": expected SETTING=VALUE");
    settings.Set(text.substr(0, equals), text.substr(equals + 1), text);
  }
  learner.Check(train.envs);

  ThreadPool pool(int(train.threads == 0 ? 1 : train.threads));
  PendulumV1 env(int(train.envs), uint64_t(train.seed));
  std::unique_ptr<Agent> agent;
  if (is_ppo) {
    agent = std::make_unique<Ppo>(ppo, env.spec(), uint64_t(train.seed), pool);
  } else {
    agent = std::make_unique<Sac>(sac, env.spec(), uint64_t(train.seed), pool);
  }
  Printer printer;
  RodEvaluator evaluator(int(train.eval_episodes));
  Trainer trainer(train, *agent, env, evaluator);
  trainer.AddObserver(printer);
  while (trainer.Step()) continue;
  std::printf("%s after %d steps\n", trainer.state().solved ? "solved" : "not solved",
              int(trainer.state().steps));
} catch (const Error& error) {
  std::fprintf(stderr, "own_task: %s\n", error.what());
  return error.exit_code();
}
