#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "base/thread_pool.h"
#include "os/machine.h"
#include "rl/replay.h"

/// Parts of `upswing bench`: cases, which define the work to time and its amount, and their
/// reporter (tools/bench/report.h).
namespace upswing {

/// Options of the command line.
struct BenchOptions {
  std::vector<std::string> parts;   // parts to run; empty: all
  std::vector<int64_t> threads;     // a case that can use threads runs with each number; 0: chosen
  std::string network;              // for gradient: "plain", "dueling" or "" for both
  std::vector<int64_t> hidden;      // for gradient, sac and ppo: widths of layers; empty: several
  int64_t batch = 0;                // for gradient, sac and ppo: batch size; 0: several
  std::string simd;                 // vector instructions; empty: the best
  std::optional<std::string> json;  // file to write
  double seconds = 0.2;             // least time of each repetition
  int64_t repetitions = 3;          // repetitions of each case
};

/// The threads of a case. 0 means one thread per processor, up to 8. A ThreadTuner then chooses how
/// many threads work, as in a training without --threads.
struct BenchPool : ThreadPool {
  explicit BenchPool(int threads) : ThreadPool(ResolveThreads(threads), threads == 0) {}
};

/// Timed work: one call.
using BenchWork = std::function<void()>;

/// Something to measure. Its work is repeated many times.
struct BenchCase {
  std::string name;   // such as "gradient/plain/256-256/batch:128/threads:1"
  std::string items;  // unit of the count, such as "updates"
  double count = 1;   // items in one call of the work
  double flops = 0;   // additions and multiplications that one call needs at least; 0: unknown
  double bytes = 0;   // bytes that one call reads and writes; 0: unknown
  int threads = 1;    // threads that work at the same time
  /// Makes the work and everything that it needs.
  std::function<BenchWork()> prepare = {};
};
using BenchCases = std::vector<BenchCase>;

/// Number of torque levels of agents with discrete actions.
inline constexpr int kBenchActions = 9;

/// A replay memory with `size` random transitions, 2% of which terminate. Integer actions are 0 to
/// 8.
std::shared_ptr<Replay> FilledReplay(int64_t size, int obs_size, const ActionSpace& actions);

// Cases of each part.
BenchCases KernelCases(const BenchOptions& options);
BenchCases GradientCases(const BenchOptions& options);
BenchCases SacCases(const BenchOptions& options);
BenchCases PpoCases(const BenchOptions& options);
BenchCases ActCases(const BenchOptions& options);
BenchCases ReplayCases(const BenchOptions& options);
BenchCases PhysicsCases(const BenchOptions& options);
BenchCases EnvCases(const BenchOptions& options);
BenchCases TrainCases(const BenchOptions& options);

/// Single-precision multiplications and additions per second, in GFLOP/s, that `threads` threads
/// reach together with the vector instructions in use, without access to memory. This is the best
/// of several rounds of milliseconds. A fused multiply-add counts as two.
double MeasurePeakGflops(int threads);

}  // namespace upswing
