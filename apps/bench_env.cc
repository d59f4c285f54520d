// Cases of `upswing bench` for physics and environments.
#include <fmt/format.h>

#include <memory>

#include "apps/bench.h"
#include "core/rng.h"
#include "rl/dqn.h"
#include "sim/pendulum_env.h"

namespace upswing {
namespace {

/// Random torque levels for a number of control steps, which then come again.
class Torques {
 public:
  explicit Torques(int num_envs) : num_envs_(static_cast<size_t>(num_envs)) {
    const std::vector<double> levels = TorqueLevels(Plant().torque_limit);
    Rng rng(1, "benchmark");
    for (size_t i = 0; i < kSteps * num_envs_; ++i) {
      values_.push_back(levels[rng.Below(levels.size())]);
    }
  }

  /// Of the next control step (N), N·m.
  std::span<const double> Next() {
    step_ = (step_ + 1) % kSteps;
    return std::span(values_).subspan(step_ * num_envs_, num_envs_);
  }

 private:
  static constexpr size_t kSteps = 64;
  size_t num_envs_, step_ = 0;
  std::vector<double> values_;  // (kSteps, N)
};

/// Whole environment steps: physics, observation, reward and, at the end of episodes, reset.
BenchCase EnvCase(int num_envs, int threads) {
  return {fmt::format("env/mujoco/envs:{}/threads:{}", num_envs, threads),
          "steps",
          static_cast<double>(num_envs),
          0,
          0,
          threads,
          [=]() -> BenchWork {
            PendulumEnvConfig config;
            config.num_envs = num_envs;
            config.threads = threads;
            const auto env = std::make_shared<PendulumEnv>(config);
            const auto torques = std::make_shared<Torques>(num_envs);
            const auto result = std::make_shared<StepResult>(env->MakeResult());
            return [=] { env->Step(torques->Next(), *result); };
          }};
}

}  // namespace

BenchCases EnvCases(const BenchOptions& options) {
  BenchCases cases;
  for (const int num_envs : {8, 128}) {
    for (const int threads : options.threads) cases.push_back(EnvCase(num_envs, threads));
  }
  return cases;
}

}  // namespace upswing
