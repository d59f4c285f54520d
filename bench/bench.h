#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "core/thread_pool.h"
#include "io/machine.h"
#include "rl/replay.h"

/// What `upswing bench` is made of: cases, which know what to do and how much work that is, and
/// their reporter (bench/report.h).
namespace upswing {

/// What was typed.
struct BenchOptions {
  std::vector<std::string> parts;   // empty: all
  std::vector<int64_t> threads;     // a case that can use threads runs with each; 0: chosen
  std::string network;              // of gradient: "plain", "dueling" or "" for both
  std::vector<int64_t> hidden;      // of gradient, sac and ppo: widths of layers; empty: several
  int64_t batch = 0;                // of gradient, sac and ppo; 0: several
  std::string simd;                 // vector instructions; empty: the best
  std::optional<std::string> json;  // file to write
  double seconds = 0.2;             // for each repetition, at least
  int64_t repetitions = 3;          // of a case
};

/// The threads of a case. With 0 threads there is one for each processor, up to 8, and a
/// ThreadTuner chooses how many of them work, as in a training without --threads.
struct BenchPool : ThreadPool {
  explicit BenchPool(int threads) : ThreadPool(ResolveThreads(threads), threads == 0) {}
};

/// What is timed: one call of it.
using BenchWork = std::function<void()>;

/// Something to measure. Its work is done over and over.
struct BenchCase {
  std::string name;   // such as "gradient/plain/256-256/batch:128/threads:1"
  std::string items;  // what is counted: "updates"
  double count = 1;   // items in one call of the work
  double flops = 0;   // additions and multiplications that one call cannot do without; 0: unknown
  double bytes = 0;   // read and written by one call; 0: unknown
  int threads = 1;    // that work at once
  /// Makes the work, with all that it needs.
  std::function<BenchWork()> prepare = {};
};
using BenchCases = std::vector<BenchCase>;

/// Torque levels of agents that choose from some.
inline constexpr int kBenchActions = 9;

/// A replay memory filled with `size` random transitions, 2% of which terminate. Whole actions are
/// 0 to 8.
std::shared_ptr<Replay> FilledReplay(int64_t size, int obs_size, const ActionSpace& actions);

// The parts, each with its cases.
BenchCases KernelCases(const BenchOptions& options);
BenchCases GradientCases(const BenchOptions& options);
BenchCases SacCases(const BenchOptions& options);
BenchCases PpoCases(const BenchOptions& options);
BenchCases ActCases(const BenchOptions& options);
BenchCases ReplayCases(const BenchOptions& options);
BenchCases PhysicsCases(const BenchOptions& options);
BenchCases EnvCases(const BenchOptions& options);
BenchCases TrainCases(const BenchOptions& options);

/// Single-precision multiplications and additions per second, in GFLOP/s, that so many threads
/// reach at once on the vector instructions in use, without touching memory: the best of some
/// rounds of milliseconds. A fused multiply-add counts as two.
double MeasurePeakGflops(int threads);

}  // namespace upswing
