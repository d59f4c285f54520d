// Physics steps and whole environment steps per second, in MuJoCo and in closed form, one thread.
//
//   sim_bench --benchmark_repetitions=9 --benchmark_report_aggregates_only=true
//
// Arguments: number of environments; for the closed form also the path's place in SimdPaths().
#include <benchmark/benchmark.h>

#include <cmath>

#include "core/rng.h"
#include "core/simd.h"
#include "mujoco/engines.h"
#include "mujoco/model.h"
#include "sim/closed_form.h"
#include "sim/pendulum_env.h"

namespace upswing {
namespace {

/// Plants as domain randomisation would draw them.
std::vector<Plant> RandomPlants(size_t n) {
  Rng rng(1, "plants");
  std::vector<Plant> plants(n);
  for (Plant& plant : plants) {
    plant.mass2 = rng.Uniform(0.8, 1.2);
    plant.length1 = rng.Uniform(0.4, 0.6);
    plant.damping1 = rng.Uniform(0.1, 0.3);
  }
  return plants;
}

void CountSteps(benchmark::State& state, int64_t steps) {
  state.counters["steps"] = benchmark::Counter(static_cast<double>(state.iterations() * steps),
                                               benchmark::Counter::kIsRate);
}

void PhysicsInMuJoCo(benchmark::State& state) {
  const auto n = static_cast<int>(state.range(0));
  const ModelPtr model = CompileModel(Mjcf(Plant()), "bench");
  mjBatchConfig config;
  mjb_defaultConfig(&config);
  config.nthread = 1;
  char message[1000];
  const BatchPtr batch(mjb_makeBatch(model.get(), n, &config, message, sizeof(message)));
  mjb_reset(batch.get(), nullptr, 0, nullptr, mjSTAGE_NONE);
  mjtNum* q1 = mjb_stateComponent(batch.get(), mjSTATE_QPOS, nullptr);  // of the first
  for (int i = 0; i < n; ++i) q1[i * mjb_nstate(batch.get())] = std::sin(i);
  for (auto _ : state) mjb_step(batch.get(), nullptr, 0, kPhysicsSteps, mjSTAGE_NONE);
  CountSteps(state, n * kPhysicsSteps);
}
BENCHMARK(PhysicsInMuJoCo)->Arg(8)->Arg(128)->Arg(1024);

void PhysicsInClosedForm(benchmark::State& state) {
  const std::string path = SimdPaths()[static_cast<size_t>(state.range(1))];
  UseSimdPath(path);
  state.SetLabel(path);
  const auto n = static_cast<size_t>(state.range(0));
  ClosedFormBatch batch(n);
  const std::vector<Plant> plants = RandomPlants(n);
  for (size_t i = 0; i < n; ++i) {
    batch.SetPlant(i, plants[i]);
    batch.q1[i] = std::sin(static_cast<double>(i));
  }
  batch.SetTorque(std::vector<double>(n, 1.0));
  for (auto _ : state) {
    Advance(batch, kPhysicsSteps, 0, n);
    benchmark::ClobberMemory();
  }
  CountSteps(state, static_cast<int64_t>(n) * kPhysicsSteps);
}

void StepEnvironment(benchmark::State& state, const Engine* engine) {
  PendulumEnvConfig config;
  config.engine = engine;
  config.num_envs = static_cast<int>(state.range(0));
  config.plants = RandomPlants(static_cast<size_t>(config.num_envs));
  config.start.random_share = 0.5;
  PendulumEnv env(config);
  StepResult result = env.MakeResult();
  const std::vector<double> torque(config.plants.size(), 1.0);
  for (auto _ : state) env.Step(torque, result);
  CountSteps(state, config.num_envs);
}

void EnvironmentInMuJoCo(benchmark::State& state) { StepEnvironment(state, &kMuJoCo); }
BENCHMARK(EnvironmentInMuJoCo)->Arg(8)->Arg(128)->Arg(1024);

void EnvironmentInClosedForm(benchmark::State& state) {
  const std::string path = SimdPaths()[static_cast<size_t>(state.range(1))];
  UseSimdPath(path);
  state.SetLabel(path);
  StepEnvironment(state, &kClosedForm);
}

/// Each number of environments on each path.
void Arguments(benchmark::internal::Benchmark* benchmark) {
  for (size_t path = 0; path < SimdPaths().size(); ++path) {
    for (const int n : {8, 128, 1024}) benchmark->Args({n, static_cast<int64_t>(path)});
  }
}
BENCHMARK(PhysicsInClosedForm)->Apply(Arguments);
BENCHMARK(EnvironmentInClosedForm)->Apply(Arguments);

}  // namespace
}  // namespace upswing

BENCHMARK_MAIN();
