#pragma once

#include <benchmark/benchmark.h>

#include <map>
#include <sstream>
#include <string>
#include <vector>

#include "cli/progress.h"
#include "tools/bench/bench.h"

namespace upswing {

/// Prints a table while the cases are measured, and keeps Google Benchmark's JSON.
class BenchReporter : public benchmark::BenchmarkReporter {
 public:
  /// All arguments must outlive it. `peak_gflops` has the measured peaks by number of threads. If
  /// the JSON goes to standard output, no table is printed.
  BenchReporter(const BenchCases& cases, const BenchOptions& options,
                const std::map<int, double>& peak_gflops);

  bool ReportContext(const Context& context) override;
  void ReportRuns(const std::vector<Run>& runs) override;
  void Finalize() override { json_.Finalize(); }

  /// Shows on a terminal which case is being measured.
  void ShowProgress(const BenchCase& running);
  /// Marks all later reports as incomplete measurements.
  void Stop() { stopped_ = true; }
  size_t cases_done() const { return done_; }
  /// JSON of all reports in Google Benchmark's format, with our context in it. Call it after
  /// Finalize.
  std::string Json() const;

 private:
  const BenchCase& FindCase(const std::string& name) const;
  void PrintRow(const BenchCase& measured, double wall, double cpu);

  const BenchCases& cases_;
  const BenchOptions& options_;
  const std::map<int, double>& peak_gflops_;
  std::ostringstream json_text_;
  benchmark::JSONReporter json_;
  ProgressLine line_;
  bool quiet_;
  bool stopped_ = false;
  size_t done_ = 0;
  double seconds_done_ = 0;  // time of the cases that are done
  size_t name_width_ = 0;
  std::chrono::steady_clock::time_point begin_ = std::chrono::steady_clock::now();
};

}  // namespace upswing
