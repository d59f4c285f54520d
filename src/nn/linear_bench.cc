#include <benchmark/benchmark.h>

#include "base/aligned.h"
#include "base/rng.h"
#include "nn/linear.h"
#include "nn/network.h"

namespace upswing {
namespace {

/// Normal random numbers.
AlignedVector<Real> Numbers(int rows, int cols) {
  AlignedVector<Real> values(static_cast<size_t>(rows) * static_cast<size_t>(cols));
  Rng rng(1, "benchmark");
  for (Real& x : values) x = static_cast<Real>(rng.Normal());
  return values;
}

/// Sizes of a layer: B rows, `in` inputs, `out` outputs.
struct LayerSize {
  explicit LayerSize(const benchmark::State& state)
      : B(static_cast<int>(state.range(0))),
        in(static_cast<int>(state.range(1))),
        out(static_cast<int>(state.range(2))) {}
  int B, in, out;
};

/// Reports multiplications and additions per second.
void CountOperations(benchmark::State& state, const LayerSize& size) {
  const double operations = 2.0 * size.B * size.in * size.out;
  state.counters["FLOP"] = benchmark::Counter(
      operations, benchmark::Counter::kIsIterationInvariantRate, benchmark::Counter::kIs1000);
}

void BM_LinearForward(benchmark::State& state) {
  const LayerSize n(state);
  const AlignedVector<Real> x = Numbers(n.B, n.in), w = Numbers(n.in, n.out), b = Numbers(1, n.out);
  AlignedVector<Real> y = Numbers(n.B, n.out);
  const bool relu = n.out > 1;  // a critic's output has none
  for (auto _ : state) {
    LinearForward({x.data(), n.B, n.in}, {w.data(), n.in, n.out}, b, relu, {y.data(), n.B, n.out});
    benchmark::ClobberMemory();
  }
  CountOperations(state, n);
}

void BM_LinearBackwardInput(benchmark::State& state) {
  const LayerSize n(state);
  const AlignedVector<Real> dy = Numbers(n.B, n.out), transposed = Numbers(n.out, n.in);
  AlignedVector<Real> dx = Numbers(n.B, n.in);
  for (auto _ : state) {
    LinearBackwardInput({dy.data(), n.B, n.out}, {transposed.data(), n.out, n.in}, {},
                        {dx.data(), n.B, n.in});
    benchmark::ClobberMemory();
  }
  CountOperations(state, n);
}

void BM_LinearBackwardWeight(benchmark::State& state) {
  const LayerSize n(state);
  const AlignedVector<Real> x = Numbers(n.B, n.in), dy = Numbers(n.B, n.out);
  AlignedVector<Real> dw = Numbers(n.in, n.out), db = Numbers(1, n.out);
  for (auto _ : state) {
    LinearBackwardWeight({x.data(), n.B, n.in}, {dy.data(), n.B, n.out}, {dw.data(), n.in, n.out},
                         db);
    benchmark::ClobberMemory();
  }
  CountOperations(state, n);
}

/// The first layer of the agent `fast`, one of its hidden layers, the output of a critic of `ppo`,
/// and a layer of `d3qn`.
void LayerSizes(benchmark::internal::Benchmark* b) {
  b->ArgNames({"B", "in", "out"});
  b->Args({64, 8, 64})->Args({64, 64, 64})->Args({32, 64, 1})->Args({128, 256, 256});
}
BENCHMARK(BM_LinearForward)->Apply(LayerSizes);
BENCHMARK(BM_LinearBackwardInput)->Apply(LayerSizes);
BENCHMARK(BM_LinearBackwardWeight)->Apply(LayerSizes);

/// One gradient of a dueling network with 8 inputs, two hidden layers and 9 outputs.
void BM_NetworkGradient(benchmark::State& state) {
  const int B = 128;
  const Network network({.inputs = 8, .hidden = {256, 256}, .outputs = 9, .streams = 128});
  AlignedVector<Real> parameters(network.num_parameters()), gradient(network.num_parameters());
  Rng rng(1, "benchmark");
  network.Initialize(rng, parameters);
  Network::Activations activations = network.MakeActivations(B, true);
  const AlignedVector<Real> x = Numbers(B, 8), dy = Numbers(B, 9);
  AlignedVector<Real> y = Numbers(B, 9);
  for (auto _ : state) {
    network.Forward(parameters, {x.data(), B, 8}, {0, B}, activations, {y.data(), B, 9});
    network.Backward(parameters, {x.data(), B, 8}, activations, {dy.data(), B, 9}, gradient);
    benchmark::ClobberMemory();
  }
}
BENCHMARK(BM_NetworkGradient);

}  // namespace
}  // namespace upswing
