#include <benchmark/benchmark.h>

#include <algorithm>
#include <ctime>

#include "control/mpc.h"
#include "pendulum/pendulum_env.h"

namespace upswing {
namespace {

/// Processor time of one decision of `mpc`, a mean over the first 2 s of swing-ups from hanging,
/// without the first plan of an episode. `worst [ms]` is the longest decision:
/// `--benchmark_filter=Mpc --benchmark_min_time=30` makes about 100,000 of them.
void BM_MpcDecision(benchmark::State& state) {
  const Plant plant;
  const MpcPolicy policy(LqrConfig{}, MpcConfig{}, plant);
  const PendulumEnvConfig config;
  PendulumEnv env(config);
  StepResult result = env.MakeResult();
  auto memory = policy.Start(1);
  double torque = 0;
  double worst = 0;  // s
  int decision = 0;
  const auto decide = [&] {
    const std::clock_t begin = std::clock();
    policy.Act(env.obs(), {&torque, 1, 1}, *memory);
    return static_cast<double>(std::clock() - begin) / CLOCKS_PER_SEC;
  };
  const auto restart = [&] {
    env.Restart(0, 0);
    memory = policy.Start(1);
    decide();
    decision = 0;
  };
  restart();
  for (auto _ : state) {
    env.Step({&torque, 1}, result);
    const double seconds = decide();
    state.SetIterationTime(seconds);
    worst = std::max(worst, seconds);
    if (++decision == 100) restart();
  }
  state.counters["worst [ms]"] = 1e3 * worst;
}
BENCHMARK(BM_MpcDecision)->UseManualTime()->Unit(benchmark::kMillisecond);

}  // namespace
}  // namespace upswing
