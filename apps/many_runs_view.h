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
  /// Both must outlive it. The rate counts the steps made from now on.
  ManyRunsView(const ManyRuns& plan, const std::vector<SeedRun>& runs);

  /// Prints what is trained and where.
  void Announce() const;

  /// Whether the progress line should be updated now; false without a terminal.
  bool due() const { return line_.due(); }
  void ShowProgress(const std::vector<const SeedRun*>& running);

  /// A line on a run that has ended in any way.
  void PrintEnd(const SeedRun& run);

  /// Prints all results and the next command to type.
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
