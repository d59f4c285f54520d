#pragma once

#include <cstdint>
#include <functional>
#include <string>
#include <vector>

/// Parts of `upswing bench`: cases, which define the work to time and its amount.
namespace upswing {

/// Options of the command line.
struct BenchOptions {
  std::vector<std::string> names;  // beginnings of the names of the cases to run; empty: all
  std::vector<int64_t> threads;    // a case that can use threads runs with each number
  std::vector<int64_t> hidden;     // for gradient: widths of layers; empty: several
  int64_t batch = 0;               // for gradient: batch size; 0: several
  std::string simd;                // vector instructions; empty: the best
  std::string json;                // file to write; empty: none
  double seconds = 0.2;            // least time of each repetition
  int64_t repetitions = 1;         // repetitions of each case
};

/// Timed work: one call.
using BenchWork = std::function<void()>;

/// Something to measure. Its work is repeated many times.
struct BenchCase {
  std::string name;  // such as "gradient/plain/256-256/batch:128/threads:1"
  double count = 1;  // items, such as steps, in one call of the work
  /// Makes the work and everything that it needs.
  std::function<BenchWork()> prepare = {};
};
using BenchCases = std::vector<BenchCase>;

/// Number of torque levels of agents with discrete actions.
inline constexpr int kBenchActions = 9;

// Cases of each part.
BenchCases GradientCases(const BenchOptions& options);
BenchCases EnvCases(const BenchOptions& options);

}  // namespace upswing
