#include "run/run_log.h"

#include <fmt/format.h>

#include <algorithm>

#include "core/error.h"
#include "core/simd.h"
#include "core/text.h"
#include "io/file.h"
#include "io/machine.h"
#include "io/run_folder.h"

namespace upswing {
namespace {

namespace fs = std::filesystem;

// What the lines are made of, in their order; the processor's name ends its line.
constexpr std::string_view kHost = ", host ";
constexpr std::string_view kVectors = ", vector instructions ";
constexpr std::string_view kThreads = ", threads ";
constexpr std::string_view kProcessor = ", processor ";
constexpr std::string_view kBusy = ", threads busy ";
constexpr std::string_view kPercent = "% of ";

/// What stands in `line` between `before` and the next `after` (empty: the line's end).
std::optional<std::string> Between(std::string_view line, std::string_view before,
                                   std::string_view after) {
  const size_t at = line.find(before);
  if (at == std::string_view::npos) return std::nullopt;
  line.remove_prefix(at + before.size());
  const size_t end = after.empty() ? line.size() : line.find(after);
  if (end == std::string_view::npos) return std::nullopt;
  return std::string(line.substr(0, end));
}

void AddLine(std::string_view line, RunConditions& conditions) {
  if (const auto host = Between(line, kHost, kVectors)) conditions.hosts.insert(*host);
  if (const auto vectors = Between(line, kVectors, kThreads)) conditions.vectors.insert(*vectors);
  if (const auto name = Between(line, kProcessor, "")) conditions.processors.insert(*name);
  const auto threads = ParseInteger(Between(line, kThreads, kProcessor).value_or(""));
  if (threads) conditions.threads.insert(*threads);
  constexpr double kLongEnough = 2;  // s: less than that says little
  const auto percent = ParseNumber(Between(line, kBusy, kPercent).value_or(""));
  const auto seconds = ParseNumber(Between(line, kPercent, " s").value_or(""));
  if (percent && seconds && *seconds >= kLongEnough) {
    conditions.busy = std::min(conditions.busy.value_or(1e9), *percent / 100);
  }
}

}  // namespace

double WorkClock::seconds() const {
  return std::chrono::duration<double>(std::chrono::steady_clock::now() - begin_).count();
}

double WorkClock::busy(int threads) const {
  const double at_work = static_cast<double>(std::clock() - cpu_begin_) / CLOCKS_PER_SEC;
  return at_work / std::max(1e-9, seconds() * threads);
}

std::string BeginLine(bool resumed, int64_t step, int threads) {
  return Concat(resumed ? "resumed" : "started", " at step ", step, kHost, HostName(), kVectors,
                SimdPath(), kThreads, threads, kProcessor, CpuModel());
}

std::string EndLine(bool finished, int64_t step, int threads, const WorkClock& clock) {
  return fmt::format("{} at step {}{}{:.0f}{}{:.1f} s", finished ? "finished" : "stopped", step,
                     kBusy, 100 * clock.busy(threads), kPercent, clock.seconds());
}

RunConditions ReadConditions(const fs::path& run) {
  const fs::path path = run / RunFolder::kLog;
  constexpr uintmax_t kLargest = 1 << 22;  // bytes: no log that a training writes is larger
  RunConditions conditions;
  std::error_code error;
  if (!fs::is_regular_file(path, error) || fs::file_size(path, error) > kLargest) return conditions;
  try {
    const std::string text = ReadTextFile(path);
    for (const std::string_view line : Split(text, '\n')) AddLine(line, conditions);
  } catch (const Error&) {  // NOLINT(bugprone-empty-catch): then nothing is known
  }
  return conditions;
}

}  // namespace upswing
