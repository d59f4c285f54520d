#pragma once

#include <benchmark/benchmark.h>

#include <map>
#include <sstream>
#include <string>
#include <vector>

#include "apps/progress.h"
#include "bench/bench.h"

namespace upswing {

/// The machine and how it was used.
struct BenchContext {
  std::string cpu_model, simd_path;
  std::vector<int64_t> threads;
  std::map<int, double> peak_gflops;  // by number of threads; empty: not measured
  double seconds;                     // of a repetition
  int repetitions;
};

/// Prints a table as the cases are measured, and keeps what Google Benchmark writes as JSON.
class BenchReporter : public benchmark::BenchmarkReporter {
 public:
  /// `quiet`: no table is printed.
  BenchReporter(const BenchCases& cases, const BenchContext& context, bool quiet);

  bool ReportContext(const Context& context) override;
  void ReportRuns(const std::vector<Run>& runs) override;
  void Finalize() override { json_.Finalize(); }

  /// Shows on a terminal which case is being measured.
  void ShowProgress(const BenchCase& running);
  /// What is reported from now on was not measured to its end.
  void Stop() { stopped_ = true; }
  size_t cases_done() const { return done_; }
  /// JSON of all that was reported, in Google Benchmark's format with our context in it. After
  /// Finalize.
  std::string Json() const;

 private:
  const BenchCase& FindCase(const std::string& name) const;
  void PrintRow(const BenchCase& measured, double wall, double cpu);

  const BenchCases& cases_;
  const BenchContext& context_;
  std::ostringstream json_text_;
  benchmark::JSONReporter json_;
  ProgressLine line_;
  bool quiet_;
  bool stopped_ = false;
  size_t done_ = 0;
  double seconds_done_ = 0;  // that they took
  size_t name_width_ = 0;
  std::chrono::steady_clock::time_point begin_ = std::chrono::steady_clock::now();
};

}  // namespace upswing
