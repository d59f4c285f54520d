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

/// Random torque levels for kSteps control steps, repeated in a cycle.
class Torques {
 public:
  explicit Torques(int num_envs) : num_envs_(static_cast<size_t>(num_envs)) {
    const std::vector<double> levels = TorqueLevels(Plant().torque_limit, kBenchActions);
    Rng rng(1, "benchmark");
    for (size_t i = 0; i < kSteps * num_envs_; ++i) {
      values_.push_back(levels[rng.Below(levels.size())]);
    }
  }

  /// Torques (N) of the next control step, N·m.
  std::span<const double> Next() {
    step_ = (step_ + 1) % kSteps;
    return std::span(values_).subspan(step_ * num_envs_, num_envs_);
  }

 private:
  static constexpr size_t kSteps = 64;
  size_t num_envs_, step_ = 0;
  std::vector<double> values_;  // (kSteps, N)
};

/// Case of whole environment steps: physics, observation, reward and, at the end of episodes,
/// reset.
BenchCase EnvCase(const std::string& physics, int num_envs, int threads) {
  return {.name = fmt::format("env/{}/envs:{}/threads:{}", physics, num_envs, threads),
          .count = static_cast<double>(num_envs),
          .threads = threads,
          .prepare = [=]() -> BenchWork {
            const auto pool = std::make_shared<ThreadPool>(threads);
            PendulumEnvConfig config;
            config.engine = &FindEngine(physics, "physics");
            config.num_envs = num_envs;
            config.pool = pool.get();
            const auto env = std::make_shared<PendulumEnv>(config);
            const auto torques = std::make_shared<Torques>(num_envs);
            const auto result = std::make_shared<StepResult>(env->MakeResult());
            return [=, keep = pool] { env->Step(torques->Next(), *result); };
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
