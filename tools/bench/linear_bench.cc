// The three products of a linear layer in four implementations. These are our kernels on each
// instruction set, Eigen, libxsmm (where it is installed), and a register tile in plain C++ that
// the compiler vectorises.
//
// This file is compiled for the processor of the building machine.
//
//   build/release/bin/nn_bench --benchmark_filter=256x256 --benchmark_repetitions=5
#include <benchmark/benchmark.h>

#include <Eigen/Core>
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <functional>
#include <memory>
#include <string>
#include <vector>
#ifdef UPSWING_HAS_LIBXSMM
#include <libxsmm.h>
#endif

#include "base/aligned.h"
#include "base/rng.h"
#include "base/simd.h"
#include "base/text.h"
#include "nn/linear.h"

namespace upswing {
namespace {

enum class Kind { kForward, kBackwardInput, kBackwardWeight };

/// C (M × N) = A (M × K) · B (K × N), plus a bias (N) on each row if there is one. A is stored as
/// (K × M) if `a_transposed`, as the gradient of the weights needs it.
struct Task {
  std::string name;
  bool a_transposed, has_bias;
  Matrix<const float> a, b;
  std::span<const float> bias;
  Matrix<float> c;

  int M() const { return c.rows(); }
  int N() const { return c.cols(); }
  int K() const { return b.rows(); }
  double flops() const { return 2.0 * M() * N() * K(); }
};

/// A task with its numbers, for `width` inputs and outputs and a batch of B.
struct Problem {
  Problem(Kind kind, int width, int B) {
    Rng rng(1, "benchmark");
    const bool weight = kind == Kind::kBackwardWeight;
    const auto batch_size = static_cast<size_t>(B * width);
    const auto square_size = static_cast<size_t>(width * width);
    a.resize(batch_size);
    b.resize(weight ? batch_size : square_size);
    bias.resize(static_cast<size_t>(width));
    c.resize(weight ? square_size : batch_size);
    for (auto* numbers : {&a, &b, &bias}) {
      for (float& x : *numbers) x = static_cast<float>(rng.Normal());
    }
    const char* names[] = {"forward", "backward_input", "backward_weight"};
    task = {Concat(names[static_cast<int>(kind)], "/", width, "x", width, "/batch:", B),
            weight,
            kind == Kind::kForward,
            {a.data(), B, width},
            {b.data(), weight ? B : width, width},
            bias,
            {c.data(), weight ? width : B, width}};
  }

  AlignedVector<float> a, b, bias, c;
  Task task;
};

/// One library's implementation of a task. Ours, WithEigen and so on prepare it.
using Doer = std::function<void()>;

// ---- Our kernels.

Doer Ours(const Task& t) {
  if (t.a_transposed) return [&t] { LinearBackwardWeight(t.a, t.b, t.c); };
  if (!t.has_bias) return [&t] { LinearBackwardInput(t.a, t.b, {}, t.c); };
  return [&t] { LinearForward(t.a, t.b, t.bias, false, t.c); };
}

// ---- Eigen.

Doer WithEigen(const Task& t) {
  using Rows = Eigen::Matrix<float, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;
  const auto view = [](Matrix<const float> m) {
    return Eigen::Map<const Rows, Eigen::Aligned64>(m.data(), m.rows(), m.cols());
  };
  Eigen::Map<Rows, Eigen::Aligned64> c(t.c.data(), t.M(), t.N());
  const auto a = view(t.a);
  const auto b = view(t.b);
  if (t.a_transposed) return [=]() mutable { c.noalias() = a.transpose() * b; };
  if (!t.has_bias) return [=]() mutable { c.noalias() = a * b; };
  const Eigen::Map<const Eigen::RowVectorXf, Eigen::Aligned64> bias(t.bias.data(), t.N());
  return [=]() mutable {
    c.noalias() = a * b;
    c.rowwise() += bias;
  };
}

// ---- libxsmm. Its matrices are column-major: Cᵀ = Bᵀ Aᵀ.

#ifdef UPSWING_HAS_LIBXSMM
Doer WithLibxsmm(const Task& t) {
  const int lda = t.N();
  const int ldb = t.a_transposed ? t.M() : t.K();
  const int ldc = t.N();
  const float alpha = 1;
  const float beta = t.has_bias ? 1 : 0;
  const int flags = t.a_transposed ? LIBXSMM_GEMM_FLAG_TRANS_B : LIBXSMM_GEMM_FLAG_NONE;
  const libxsmm_smmfunction kernel =
      libxsmm_smmdispatch(t.N(), t.M(), t.K(), &lda, &ldb, &ldc, &alpha, &beta, &flags, nullptr);
  if (kernel == nullptr) return nullptr;
  return [&t, kernel] {
    // The kernel adds to C, so C begins with the bias in each row.
    for (int i = 0; t.has_bias && i < t.M(); ++i) std::ranges::copy(t.bias, t.c.row(i).begin());
    kernel(t.b.data(), t.a.data(), t.c.data());
  };
}
#endif

// ---- A register tile in plain C++.

constexpr int kTileCols = 32;

/// Computes the tile of C at (m, n), kRows × kTileCols, in sums that the compiler can keep in
/// registers.
template <int kRows>
void PlainTile(const Task& t, int m, int n) {
  const ptrdiff_t a_m = t.a_transposed ? 1 : t.a.stride();
  const ptrdiff_t a_k = t.a_transposed ? t.a.stride() : 1;
  float sum[kRows][kTileCols] = {};
  const float* a = t.a.data() + m * a_m;
  const float* b = &t.b(0, n);
  for (int k = 0; k < t.K(); ++k, a += a_k, b += t.b.stride()) {
    for (int i = 0; i < kRows; ++i) {
      for (int j = 0; j < kTileCols; ++j) sum[i][j] += a[i * a_m] * b[j];
    }
  }
  for (int i = 0; i < kRows; ++i) {
    for (int j = 0; j < kTileCols; ++j) {
      t.c(m + i, n + j) = sum[i][j] + (t.has_bias ? t.bias[static_cast<size_t>(n + j)] : 0);
    }
  }
}

/// For sizes that tiles divide: N by kTileCols, and M by 8; any other M goes row by row.
Doer WithPlainTile(const Task& t) {
  return [&t] {
    for (int n = 0; n < t.N(); n += kTileCols) {
      int m = 0;
      for (; m + 8 <= t.M(); m += 8) PlainTile<8>(t, m, n);
      for (; m < t.M(); ++m) PlainTile<1>(t, m, n);
    }
  };
}

// ---- All implementations, checked against each other and then measured.

struct Hand {
  std::string name;
  std::string simd;  // path for our kernels; empty: another library
  Doer (*make)(const Task&);
};

std::vector<Hand> Hands() {
  std::vector<Hand> hands;
  for (const std::string& path : SimdPaths()) hands.push_back({"ours-" + path, path, Ours});
  hands.push_back({"eigen", "", WithEigen});
#ifdef UPSWING_HAS_LIBXSMM
  hands.push_back({"libxsmm", "", WithLibxsmm});
#endif
  hands.push_back({"plain_tile", "", WithPlainTile});
  return hands;
}

/// Largest error against sums in double, relative to the allowed rounding of K terms of size 1.
double Error(const Task& t) {
  double largest = 0;
  for (int i = 0; i < t.M(); ++i) {
    for (int j = 0; j < t.N(); ++j) {
      double sum = t.has_bias ? t.bias[static_cast<size_t>(j)] : 0;
      for (int k = 0; k < t.K(); ++k) {
        sum += static_cast<double>(t.a_transposed ? t.a(k, i) : t.a(i, k)) * t.b(k, j);
      }
      largest = std::max(largest, std::abs(t.c(i, j) - sum));
    }
  }
  return largest / (4 * std::numeric_limits<float>::epsilon() * (t.K() + 8.0));
}

/// Registers the benchmark of an implementation if it is correct. Returns whether it is correct.
bool CheckAndRegister(const Hand& hand, const std::shared_ptr<Problem>& problem) {
  if (!hand.simd.empty()) UseSimdPath(hand.simd);
  const std::string name = hand.name + "/" + problem->task.name;
  const Doer doer = hand.make(problem->task);
  std::ranges::fill(problem->c, std::numeric_limits<float>::quiet_NaN());
  if (doer) doer();
  if (!doer || !(Error(problem->task) < 1)) {
    std::fprintf(stderr, "nn_bench: %s: %s\n", name.c_str(),
                 doer ? "the result is wrong" : "cannot be done");
    return false;
  }
  benchmark::RegisterBenchmark(name.c_str(), [=](benchmark::State& state) {
    if (!hand.simd.empty()) UseSimdPath(hand.simd);
    for ([[maybe_unused]] auto iteration : state) {
      doer();
      benchmark::ClobberMemory();
    }
    state.counters["GFLOP/s"] =
        benchmark::Counter(1e-9 * problem->task.flops() * static_cast<double>(state.iterations()),
                           benchmark::Counter::kIsRate);
  });
  return true;
}

int Main(int argc, char** argv) {
  benchmark::Initialize(&argc, argv);
  if (benchmark::ReportUnrecognizedArguments(argc, argv)) return 2;
  bool right = true;
  const auto add = [&](Kind kind, int width, int B) {
    const auto problem = std::make_shared<Problem>(kind, width, B);
    for (const Hand& hand : Hands()) right &= CheckAndRegister(hand, problem);
  };
  for (const auto& [width, B] : {std::pair(256, 32), {256, 128}, {64, 128}}) {
    for (const Kind kind : {Kind::kForward, Kind::kBackwardInput, Kind::kBackwardWeight}) {
      add(kind, width, B);
    }
  }
  for (const int width : {256, 64}) add(Kind::kForward, width, 1);
  if (!right) return 1;
  benchmark::RunSpecifiedBenchmarks();
  return 0;
}

}  // namespace
}  // namespace upswing

int main(int argc, char** argv) { return upswing::Main(argc, argv); }
