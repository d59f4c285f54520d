// Cases of `upswing bench env`.
#include <fmt/format.h>

#include <memory>

#include "base/rng.h"
#include "base/thread_pool.h"
#include "mujoco/engines.h"
#include "pendulum/pendulum_env.h"
#include "rl/torque_levels.h"
#include "tools/bench/bench.h"

namespace upswing {
namespace {

constexpr size_t kSteps = 64;  // control steps after which the torques repeat

/// Random torque levels (kSteps × N), N·m.
std::vector<double> RandomTorques(int num_envs) {
  const std::vector<double> levels = TorqueLevels(Plant().torque_limit, kBenchActions);
  std::vector<double> torques(kSteps * static_cast<size_t>(num_envs));
  Rng rng(1, "benchmark");
  for (double& torque : torques) torque = levels[rng.Below(levels.size())];
  return torques;
}

/// Case of whole environment steps: physics, observation, reward and, at the end of episodes,
/// reset.
BenchCase EnvCase(const std::string& physics, int num_envs, int threads) {
  return {.name = fmt::format("env/{}/envs:{}/threads:{}", physics, num_envs, threads),
          .count = static_cast<double>(num_envs),
          .prepare = [=]() -> BenchWork {
            const auto pool = std::make_shared<ThreadPool>(threads);
            PendulumEnvConfig config;
            config.engine = &FindEngine(physics, "physics");
            config.num_envs = num_envs;
            config.pool = pool.get();
            const auto env = std::make_shared<PendulumEnv>(config);
            const auto result = std::make_shared<StepResult>(env->MakeResult());
            return [=, keep = pool, torques = RandomTorques(num_envs), step = 0]() mutable {
              step = (step + 1) % static_cast<int>(kSteps);
              env->Step(std::span(torques).subspan(step * num_envs, num_envs), *result);
            };
          }};
}

}  // namespace

BenchCases EnvCases(const BenchOptions& options) {
  BenchCases cases;
  for (const std::string& physics : EngineNames()) {
    for (const int num_envs : {8, 128, 1024}) {
      for (const int64_t threads : options.threads) {
        cases.push_back(EnvCase(physics, num_envs, static_cast<int>(threads)));
      }
    }
  }
  return cases;
}

}  // namespace upswing
