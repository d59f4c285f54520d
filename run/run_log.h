#pragma once

#include <chrono>
#include <cstdint>
#include <ctime>
#include <filesystem>
#include <optional>
#include <set>
#include <string>

namespace upswing {

/// The machine of a run and its share of it, read from the run's log.txt: what its times depend on.
/// Sets, because a run may have been resumed on another machine.
struct RunConditions {
  std::set<int64_t> threads;
  std::set<std::string> hosts, vectors, processors;  // vectors: instructions in use
  std::optional<double> busy;  // the least share of the time that its threads were at work
};

/// The time that this process has taken since the clock was made, of the wall and of its threads.
class WorkClock {
 public:
  double seconds() const;
  /// Share of the time in which `threads` threads were at work, about 0 to 1.
  double busy(int threads) const;

 private:
  std::chrono::steady_clock::time_point begin_ = std::chrono::steady_clock::now();
  std::clock_t cpu_begin_ = std::clock();
};

/// The line with which a run begins (`started` or `resumed`) at a step.
std::string BeginLine(bool resumed, int64_t step, int threads);

/// The line with which it ends: `finished` or stopped.
std::string EndLine(bool finished, int64_t step, int threads, const WorkClock& clock);

/// What a run's log.txt says; empty if there is none that can be read.
RunConditions ReadConditions(const std::filesystem::path& run);

}  // namespace upswing
