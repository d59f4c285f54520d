#pragma once

#include <chrono>
#include <string>
#include <vector>

#include "apps/many_runs.h"
#include "apps/progress.h"

namespace upswing {

/// What people see of many runs: a progress line, a line for each that has ended, a table.
class ManyRunsView {
 public:
  /// Both must outlive it; how far the runs are now is where the rate begins to count.
  ManyRunsView(const ManyRuns& plan, const std::vector<SeedRun>& runs);

  /// Says what begins here.
  void Announce() const;

  /// Whether there is a terminal that should see how it goes on.
  bool due() const { return line_.due(); }
  void ShowProgress(const std::vector<const SeedRun*>& running);

  /// A line on a run that has ended in any way.
  void PrintEnd(const SeedRun& run);

  /// Says what came of all and what to type next.
  void Summarize(bool stopped);

 private:
  /// How far all runs are together.
  struct Progress {
    size_t done = 0;             // runs
    double steps = 0, left = 0;  // made, and at most to be made
    double share = 0;            // of the work, 0 to 1
    double steps_per_second = 0;
    std::string time_left;  // such as `at most 3 min 20 s left`
  };
  Progress Measure() const;
  void PrintTable(const Variant& variant) const;

  const ManyRuns& plan_;
  const std::vector<SeedRun>& runs_;
  ProgressLine line_;
  double steps_before_;  // made before this process
  std::chrono::steady_clock::time_point begin_ = std::chrono::steady_clock::now();
};

}  // namespace upswing
