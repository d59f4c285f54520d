#include "tools/bench/report.h"

#include <fmt/format.h>

#include <algorithm>
#include <nlohmann/json.hpp>

#include "base/format.h"
#include "base/sample.h"
#include "base/simd.h"
#include "base/text.h"
#include "os/streams.h"

namespace upswing {
namespace {

/// Formats seconds with three digits and a suitable unit.
std::string FormatTime(double seconds) {
  if (seconds < 1e-6) return fmt::format("{:.3g} ns", 1e9 * seconds);
  if (seconds < 1e-3) return fmt::format("{:.3g} µs", 1e6 * seconds);
  if (seconds < 1) return fmt::format("{:.3g} ms", 1e3 * seconds);
  return fmt::format("{:.3g} s", seconds);
}

std::string Row(size_t name_width, const std::string& name, const std::string& rate,
                const std::string& gflops, const std::string& share, const std::string& gigabytes,
                const std::string& wall, const std::string& cpu) {
  std::string row = fmt::format("{:<{}}  {:>25}  {:>8}  {:>7}  {:>6}  {:>8}  {:>8}", name,
                                name_width, rate, gflops, share, gigabytes, wall, cpu);
  return row.substr(0, row.find_last_not_of(' ') + 1);
}

}  // namespace

BenchReporter::BenchReporter(const BenchCases& cases, const BenchOptions& options,
                             const std::map<int, double>& peak_gflops)
    : cases_(cases),
      options_(options),
      peak_gflops_(peak_gflops),
      quiet_(options.json && IsStandardStream(*options.json)) {
  json_.SetOutputStream(&json_text_);
  json_.SetErrorStream(&json_text_);
  for (const BenchCase& c : cases_) name_width_ = std::max(name_width_, c.name.size());
}

bool BenchReporter::ReportContext(const Context& context) {
  if (quiet_) return json_.ReportContext(context);
  std::string peaks;
  for (const auto& [threads, gflops] : peak_gflops_) {
    peaks += fmt::format("{} {:.1f} GFLOP/s with {} thread{}", peaks.empty() ? "; peak" : ",",
                         gflops, threads, threads == 1 ? "" : "s");
  }
  const std::vector<double>& load = context.cpu_info.load_avg;
  line_.Print(fmt::format(
      "{}, {} processors{}, vector instructions {}{}", CpuModel(), context.cpu_info.num_cpus,
      load.empty() ? "" : fmt::format(" (load {:.1f})", load.front()), SimdPath(), peaks));
  line_.Print(fmt::format("Median of {} × {} s for each of {} cases; times are those of one item",
                          options_.repetitions, FormatNumber(options_.seconds), cases_.size()));
  line_.Print(Row(name_width_, "case", "rate", "GFLOP/s", "of peak", "GB/s", "wall", "CPU"));
  return json_.ReportContext(context);
}

void BenchReporter::ReportRuns(const std::vector<Run>& runs) {
  if (stopped_ || runs.empty()) return;
  // Use our own names, without the settings that Google Benchmark appends, and the number of
  // threads of the work.
  const BenchCase& measured = FindCase(runs.front().run_name.function_name);
  std::vector<Run> named = runs;
  for (Run& run : named) {
    run.run_name = {};
    run.run_name.function_name = measured.name;
    run.threads = measured.threads;
  }
  json_.ReportRuns(named);

  std::vector<double> wall, cpu;
  for (const Run& run : named) {
    if (run.run_type != Run::RT_Iteration) continue;
    wall.push_back(run.real_accumulated_time / static_cast<double>(run.iterations));
    cpu.push_back(run.cpu_accumulated_time / static_cast<double>(run.iterations));
  }
  if (wall.empty()) return;
  PrintRow(measured, QuartilesOf(wall).median, QuartilesOf(cpu).median);
  ++done_;
  seconds_done_ = std::chrono::duration<double>(std::chrono::steady_clock::now() - begin_).count();
}

const BenchCase& BenchReporter::FindCase(const std::string& name) const {
  return *std::ranges::find(cases_, name, &BenchCase::name);
}

void BenchReporter::PrintRow(const BenchCase& measured, double wall, double cpu) {
  if (quiet_) return;
  const double rate = measured.count / wall;
  const double gflops = 1e-9 * measured.flops / wall;
  const auto peak = peak_gflops_.find(measured.threads);
  const bool has_flops = measured.flops > 0;
  line_.Print(Row(
      name_width_, measured.name, fmt::format("{} {}/s", FormatCount(rate), measured.items),
      has_flops ? fmt::format("{:.1f}", gflops) : "",
      has_flops && peak != peak_gflops_.end() ? fmt::format("{:.0f}%", 100 * gflops / peak->second)
                                              : "",
      measured.bytes > 0 ? fmt::format("{:.1f}", 1e-9 * measured.bytes / wall) : "",
      FormatTime(wall / measured.count), FormatTime(cpu / measured.count)));
}

void BenchReporter::ShowProgress(const BenchCase& running) {
  if (quiet_ || !line_.due()) return;
  const double share = static_cast<double>(done_) / static_cast<double>(cases_.size());
  std::vector<std::string> fields{running.name};
  if (done_ > 0) {
    fields.push_back(FormatDuration(seconds_done_ * (1 - share) / share) + " left");
  }
  line_.Show(share, fields);
}

std::string BenchReporter::Json() const {
  auto json = nlohmann::ordered_json::parse(json_text_.str());
  auto& context = json["context"];
  context["upswing_version"] = UPSWING_VERSION;
  context["cpu_model"] = CpuModel();
  context["simd_path"] = SimdPath();
  context["threads"] = options_.threads;
  context["peak_gflops"] = nlohmann::ordered_json::object();
  for (const auto& [threads, gflops] : peak_gflops_) {
    context["peak_gflops"][std::to_string(threads)] = gflops;
  }
  context["seconds"] = options_.seconds;
  context["repetitions"] = options_.repetitions;
  return json.dump(2) + "\n";
}

}  // namespace upswing
