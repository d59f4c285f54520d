// Cases of `upswing bench kernels`, and the peak rate that they are compared with.
#include <benchmark/benchmark.h>
#include <fmt/format.h>

#include <algorithm>
#include <atomic>
#include <chrono>
#include <memory>
#include <thread>

#include "base/aligned.h"
#include "base/rng.h"
#include "base/thread_pool.h"
#include "nn/linear.h"
#include "tools/bench/bench.h"
#include "tools/bench/roofline.h"

namespace upswing {
namespace {

AlignedVector<float> RandomNumbers(size_t n, Rng& rng) {
  AlignedVector<float> numbers(n);
  for (float& x : numbers) x = static_cast<float>(rng.Normal());
  return numbers;
}

/// A linear layer with `width` inputs and outputs and a batch of B.
struct Layer {
  Layer(int width, int B)
      : x_values(RandomNumbers(static_cast<size_t>(B * width), rng)),
        w_values(RandomNumbers(static_cast<size_t>(width * width), rng)),
        y_values(x_values.size()),
        dw_values(w_values.size()),
        bias(static_cast<size_t>(width)),
        x(x_values.data(), B, width),
        w(w_values.data(), width, width),
        y(y_values.data(), B, width),
        dw(dw_values.data(), width, width) {}

  Rng rng{1, "benchmark"};
  AlignedVector<float> x_values, w_values, y_values, dw_values, bias;
  Matrix<const float> x, w;  // (B × width), (width × width)
  Matrix<float> y, dw;       // (B × width), (width × width)
};

/// Adds the three products of a linear layer, as in a gradient step.
void AddProducts(int width, int B, BenchCases& cases) {
  const auto add = [&](const char* name, auto multiply) {
    cases.push_back({.name = fmt::format("kernels/{0}/{1}x{1}/batch:{2}", name, width, B),
                     .flops = 2.0 * width * width * B,
                     .prepare = [=]() -> BenchWork {
                       const auto layer = std::make_shared<Layer>(width, B);
                       return [=] { multiply(*layer); };
                     }});
  };
  add("forward", [](Layer& l) { LinearForward(l.x, l.w, l.bias, true, l.y); });
  add("backward_input", [](Layer& l) { LinearBackwardInput(l.x, l.w, l.x, l.y); });
  add("backward_weight", [](Layer& l) { LinearBackwardWeight(l.x, l.x, l.dw); });
}

/// Case of a whole step of Adam with Polyak averaging on n parameters.
BenchCase AdamCase(size_t n) {
  constexpr double kFlops = 16;   // per parameter, with a division and a square root
  constexpr double kNumbers = 9;  // per parameter: five read, four written
  const auto count = static_cast<double>(n);
  return {.name = fmt::format("kernels/adam_polyak/{}", n),
          .flops = kFlops * count,
          .bytes = kNumbers * sizeof(float) * count,
          .prepare = [n]() -> BenchWork {
            struct Arrays {
              AlignedVector<float> g, m, v, p, target;
            };
            Rng rng(1, "benchmark");
            const auto a = std::make_shared<Arrays>();
            a->g = RandomNumbers(n, rng);
            for (auto* zeros : {&a->m, &a->v, &a->p, &a->target}) zeros->resize(n);
            return [a] {
              const AdamConstants constants{1, 0.9F, 0.999F, 1e-3F, 1e-8F, 0.005F};
              AdamPolyakStep(constants, a->g, a->m, a->v, a->p, a->target);
            };
          }};
}

BenchCase TransposeCase(int width) {
  return {.name = fmt::format("kernels/transpose/{0}x{0}", width),
          .bytes = 2.0 * sizeof(float) * width * width,
          .prepare = [width]() -> BenchWork {
            const auto layer = std::make_shared<Layer>(width, 1);
            return [=] { Transpose(layer->w, layer->dw); };
          }};
}

/// Case of the STREAM triad on three arrays of `bytes` bytes in all. It measures the bandwidth of
/// the memory that they fit into.
BenchCase TriadCase(const char* memory, size_t bytes) {
  const size_t n = bytes / (3 * sizeof(float)) / 16 * 16;
  return {.name = fmt::format("kernels/triad/{}", memory),
          .bytes = 3.0 * sizeof(float) * static_cast<double>(n),
          .prepare = [n]() -> BenchWork {
            const auto a = std::make_shared<AlignedVector<float>>(n, 1.0F);
            const auto b = std::make_shared<AlignedVector<float>>(n, 1.0F);
            const auto c = std::make_shared<AlignedVector<float>>(n, 1.0F);
            return [=] { Triad(*b, *c, 3, *a); };
          }};
}

/// Bytes of the data cache of a level; level 0: the largest cache. `otherwise` if the size is
/// unknown.
size_t CacheBytes(int level, size_t otherwise) {
  size_t bytes = 0;
  for (const auto& cache : benchmark::CPUInfo::Get().caches) {
    const bool matches = level == 0 || cache.level == level;
    if (matches && cache.type != "Instruction") {
      bytes = std::max(bytes, static_cast<size_t>(cache.size));
    }
  }
  return bytes > 0 ? bytes : otherwise;
}

}  // namespace

BenchCases KernelCases(const BenchOptions& /*options*/) {
  BenchCases cases;
  for (const int width : {64, 128, 256}) {
    for (const int B : {1, 32, 128, 256}) AddProducts(width, B, cases);
  }
  for (const size_t parameters : {13'000, 136'000}) cases.push_back(AdamCase(parameters));
  for (const int width : {64, 128, 256}) cases.push_back(TransposeCase(width));

  // Sizes: half of the L2 cache, and four times the largest cache, within bounds.
  constexpr size_t kMiB = 1 << 20;
  const size_t in_l2 = CacheBytes(2, kMiB / 2) / 2;
  const size_t in_dram = std::clamp(4 * CacheBytes(0, 32 * kMiB), 128 * kMiB, 1024 * kMiB);
  cases.push_back(TriadCase("L2", in_l2));
  cases.push_back(TriadCase("DRAM", in_dram));
  return cases;
}

double MeasurePeakGflops(int threads) {
  // Long enough to have all processors without other load for some rounds.
  constexpr std::chrono::milliseconds kDuration(300);
  constexpr int64_t kRounds = 1 << 19;  // a few milliseconds
  using Clock = std::chrono::steady_clock;
  ThreadPool pool(threads);
  double best = 0;
  for (const auto end = Clock::now() + kDuration; Clock::now() < end;) {
    std::atomic<int> arrived{0};
    std::atomic<int64_t> multiply_adds{0};
    std::vector<Clock::time_point> began(static_cast<size_t>(threads));
    pool.ParallelFor(threads, [&](int thread) {
      // Wait until all threads are here. No thread takes a second task before its first has ended.
      ++arrived;
      while (arrived < threads) std::this_thread::yield();
      began[static_cast<size_t>(thread)] = Clock::now();
      float result = 0;
      multiply_adds += MultiplyAddChains(kRounds, result);
      benchmark::DoNotOptimize(result);
    });
    const std::chrono::duration<double> elapsed = Clock::now() - *std::ranges::min_element(began);
    best = std::max(best, 2e-9 * static_cast<double>(multiply_adds) / elapsed.count());
  }
  return best;
}

}  // namespace upswing
