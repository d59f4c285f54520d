// Cases of `upswing bench` for physics and environments.
#include <fmt/format.h>

#include <algorithm>
#include <memory>

#include "base/rng.h"
#include "base/thread_pool.h"
#include "mujoco/engines.h"
#include "pendulum/closed_form.h"
#include "pendulum/pendulum_env.h"
#include "pendulum/physics.h"
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

/// MuJoCo's steps as the environment makes them. Includes the task's calculations at every fourth
/// step, a few percent of the time.
BenchWork PhysicsInMuJoCo(int num_envs, int threads) {
  const auto pool = std::make_shared<ThreadPool>(threads);
  PendulumEnvConfig config;
  config.num_envs = num_envs;
  config.pool = pool.get();
  const std::shared_ptr<Physics> physics = kMuJoCo.make(config);
  const auto torques = std::make_shared<Torques>(num_envs);
  const auto result = std::make_shared<StepResult>(PendulumSpec(config));
  return [=, keep = pool] { physics->Step(torques->Next(), *result); };
}

/// Only the steps of the closed form, in chunks as the environment shares them.
BenchWork PhysicsInClosedForm(int num_envs, int threads) {
  const auto n = static_cast<size_t>(num_envs);
  const auto batch = std::make_shared<ClosedFormBatch>(n);
  for (size_t env = 0; env < n; ++env) batch->SetPlant(env, Plant());
  const auto pool = std::make_shared<ThreadPool>(threads);
  const auto torques = std::make_shared<Torques>(num_envs);
  return [=] {
    batch->SetTorque(torques->Next());
    pool->ParallelFor(ClosedFormChunks(n), [&batch = *batch, n](int chunk) {
      const size_t first = static_cast<size_t>(chunk) * kClosedFormChunk;
      Advance(batch, kPhysicsSteps, first, std::min(first + kClosedFormChunk, n));
    });
  };
}

/// Case of Runge-Kutta steps, four per control period.
BenchCase PhysicsCase(const std::string& physics, int num_envs, int threads) {
  const bool closed_form = &FindEngine(physics, "physics") == &kClosedForm;
  return {.name = fmt::format("physics/{}/envs:{}/threads:{}", physics, num_envs, threads),
          .count = static_cast<double>(kPhysicsSteps) * num_envs,
          .threads = threads,
          .prepare = [=]() -> BenchWork {
            return closed_form ? PhysicsInClosedForm(num_envs, threads)
                               : PhysicsInMuJoCo(num_envs, threads);
          }};
}

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

/// A case for each engine, number of environments and number of threads.
template <typename MakeCase>
BenchCases CasesOf(const BenchOptions& options, const MakeCase& make) {
  BenchCases cases;
  for (const std::string& physics : EngineNames()) {
    for (const int num_envs : {8, 128, 1024}) {
      for (const int64_t threads : options.threads)
        cases.push_back(make(physics, num_envs, threads));
    }
  }
  return cases;
}

}  // namespace

BenchCases PhysicsCases(const BenchOptions& options) { return CasesOf(options, PhysicsCase); }

BenchCases EnvCases(const BenchOptions& options) { return CasesOf(options, EnvCase); }

}  // namespace upswing
