#include <benchmark/benchmark.h>

#include <array>

#include "rl/replay/replay.h"

namespace upswing {
namespace {

constexpr int kObservations = 8, kActions = 9, kBatch = 64;

/// A full replay memory of a discrete agent.
Replay FullReplay(int64_t capacity, bool prioritized) {
  Replay replay(capacity, kObservations, ActionSpace::Discrete(kActions), prioritized);
  Rng rng(1, "benchmark");
  std::array<float, kObservations> obs{}, next_obs{};
  const float action = 4;
  for (int64_t i = 0; i < capacity; ++i) {
    for (float& x : next_obs) x = static_cast<float>(rng.Normal());
    replay.Add({obs, next_obs, {&action, 1}, rng.Normal(), 0.99});
    obs = next_obs;
  }
  return replay;
}

/// One minibatch of 64 transitions, by the capacity of the memory.
void BM_ReplaySample(benchmark::State& state) {
  const Replay replay = FullReplay(state.range(0), false);
  Minibatch batch(kBatch, kObservations);
  Rng rng(2, "benchmark");
  for (auto _ : state) replay.Sample(rng, batch);
  state.SetItemsProcessed(state.iterations() * kBatch);
}
BENCHMARK(BM_ReplaySample)->Arg(10000)->Arg(1000000);

/// One minibatch by priority, and its new priorities.
void BM_ReplayPrioritized(benchmark::State& state) {
  Replay replay = FullReplay(state.range(0), true);
  Minibatch batch(kBatch, kObservations);
  Rng rng(2, "benchmark");
  ThreadPool pool(1);
  std::array<float, kBatch> td_error{};
  for (float& x : td_error) x = static_cast<float>(rng.Normal());
  for (auto _ : state) {
    replay.SamplePrioritized(rng, 0.4, pool, batch);
    replay.Prioritize(batch, td_error, 0.6);
  }
  state.SetItemsProcessed(state.iterations() * kBatch);
}
BENCHMARK(BM_ReplayPrioritized)->Arg(10000)->Arg(1000000);

}  // namespace
}  // namespace upswing
