#include <benchmark/benchmark.h>

#include "nn/adam.h"

namespace upswing {
namespace {

/// One step of Adam with Polyak averaging, by the number of parameters.
void BM_Adam(benchmark::State& state) {
  const auto n = static_cast<size_t>(state.range(0));
  Adam adam(n);
  ThreadPool pool(1);
  const AlignedVector<float> gradient(n, 0.1F);
  AlignedVector<float> parameters(n), target(n);
  const Adam::Size size{.learning_rate = 1e-3, .gradient_norm = 1, .max_norm = 10, .tau = 0.005};
  for (auto _ : state) adam.Step(size, gradient, parameters, target, pool);
  state.SetItemsProcessed(state.iterations() * state.range(0));
}
BENCHMARK(BM_Adam)->Arg(4096)->Arg(100000);

}  // namespace
}  // namespace upswing
