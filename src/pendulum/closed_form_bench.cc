#include <benchmark/benchmark.h>

#include "base/rng.h"
#include "pendulum/closed_form.h"
#include "pendulum/pendulum_env.h"

namespace upswing {
namespace {

/// N pendulums in random states.
ClosedFormBatch RandomBatch(size_t num_envs) {
  ClosedFormBatch batch(num_envs);
  Rng rng(1, "benchmark");
  for (size_t i = 0; i < num_envs; ++i) {
    batch.SetState(i, {rng.Normal(), rng.Normal(), rng.Normal(), rng.Normal()});
  }
  return batch;
}

/// One control period of N environments on one thread: Runge-Kutta steps, observation and reward.
void BM_AdvanceAndJudge(benchmark::State& state) {
  const auto N = static_cast<size_t>(state.range(0));
  ClosedFormBatch batch = RandomBatch(N);
  PendulumEnvConfig config;
  config.num_envs = static_cast<int>(N);
  StepResult result(PendulumSpec(config));
  const RewardConfig weights;
  for (auto _ : state) {
    Advance(batch, kPhysicsSteps, 0, N);
    Judge(batch, weights, 0, N, result);
    benchmark::ClobberMemory();
  }
  state.SetItemsProcessed(state.iterations() * state.range(0));
}
BENCHMARK(BM_AdvanceAndJudge)->ArgName("N")->Arg(1)->Arg(48)->Arg(1024);

}  // namespace
}  // namespace upswing
