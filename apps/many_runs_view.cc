#include "apps/many_runs_view.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "apps/say.h"
#include "core/format.h"
#include "core/sample.h"
#include "core/text.h"
#include "setup/config_checks.h"
#include "study/seeds.h"

namespace upswing {
namespace {

constexpr size_t kMostRows = 50;  // of a variant in the table
constexpr double kNever = std::numeric_limits<double>::infinity();

std::string CountOrDash(double value) { return std::isfinite(value) ? FormatCount(value) : "-"; }
std::string DurationOrDash(double value) {
  return std::isfinite(value) ? FormatDuration(value) : "-";
}

void PrintRow(const std::string& name, double step, double seconds, double success, double reward,
              const std::string& remark) {
  Say("  {:<12} {:>11}  {:>12}  {:>6.0f}%  {:>8.0f}{}{}\n", name, CountOrDash(step),
      DurationOrDash(seconds), 100 * success, reward, remark.empty() ? "" : "  ", remark);
}

}  // namespace

void ManyRunsView::Begin(const std::vector<SeedRun>& runs) {
  runs_ = &runs;
  steps_before_ = Measure().steps;
  Announce();
}

void ManyRunsView::Announce() const {
  const size_t variants = plan_.variants.size();
  Say("Training {} in {}\n", Printable(many_.what), Printable(plan_.folder.string()));
  Say("  {}seed{} {}: {}{}\n", variants == 1 ? "" : fmt::format("{} variants, ", variants),
      plan_.seeds.size() == 1 ? "" : "s", SeedsText(plan_.seeds),
      Counted(std::ssize(*runs_), "run"),
      many_.jobs == 0 ? "" : fmt::format(", {} at a time", many_.jobs));
  for (const Variant& variant : plan_.variants) {
    for (const std::string& warning : Warnings(variant.config)) {
      Say("  Warning: {}{}{}\n", Printable(variant.name), variant.name.empty() ? "" : ": ",
          warning);
    }
  }
  const auto begun =
      std::ranges::count_if(*runs_, [](const SeedRun& run) { return run.state.has_value(); });
  if (begun > 0) {
    const size_t done = Measure().done;
    Say("  {} done before, resuming {}\n", done, static_cast<size_t>(begun) - done);
  }
  const auto reduced = std::ranges::count_if(
      *runs_, [](const SeedRun& run) { return !run.finished && run.IsReduced(); });
  if (reduced > 0) {
    Say("  {} that were done with fewer steps are trained from the beginning: no more was kept\n",
        reduced);
  }
  for (const SeedRun& run : *runs_) {
    if (!run.problem.empty()) Say("  {:<20} failed: {}\n", run.name, Printable(run.problem));
  }
  std::fflush(stdout);
}

ManyRunsView::Standing ManyRunsView::Measure() const {
  Standing standing;
  for (const SeedRun& run : *runs_) {
    // Files are read for those that run alone: there may be thousands of others.
    const bool runs_now = std::ranges::find(running_, &run) != running_.end();
    const auto steps = static_cast<double>(runs_now    ? run.Steps()
                                           : run.state ? run.state->steps
                                                       : 0);
    standing.steps += steps;
    standing.done += run.finished ? 1 : 0;
    if (run.finished || !run.problem.empty()) continue;
    standing.left += std::max(0.0, static_cast<double>(run.variant->config.train.steps) - steps);
  }
  const double all = standing.steps + standing.left;
  standing.share = all > 0 ? standing.steps / all : 1;
  const std::chrono::duration<double> elapsed = std::chrono::steady_clock::now() - begin_;
  standing.steps_per_second = (standing.steps - steps_before_) / std::max(1e-3, elapsed.count());
  const bool may_end_early = std::ranges::any_of(
      *runs_, [](const SeedRun& run) { return run.variant->config.train.stop_when_solved; });
  standing.time_left = fmt::format("{} {} left", may_end_early ? "at most" : "about",
                                   standing.steps_per_second > 0
                                       ? FormatDuration(standing.left / standing.steps_per_second)
                                       : "?");
  return standing;
}

void ManyRunsView::Watch(const std::vector<const SeedRun*>& running) {
  running_ = running;
  if (!line_.due()) return;
  const Standing standing = Measure();
  std::vector<std::string> fields{
      fmt::format("{} of {} runs", standing.done, runs_->size()), standing.time_left,
      fmt::format("{} steps/s", FormatCount(std::max(0.0, standing.steps_per_second)))};
  for (const SeedRun* run : running) {
    const auto all = static_cast<double>(run->variant->config.train.steps);
    fields.push_back(
        fmt::format("{} {:.0f}%", run->name, 100 * static_cast<double>(run->Steps()) / all));
  }
  line_.Show(standing.share, fields);
}

void ManyRunsView::End(const SeedRun& run) {
  if (!run.problem.empty()) {
    return line_.Print(fmt::format("  {:<20} failed: {} (log: {})", run.name,
                                   Printable(run.problem), Printable(run.log().string())));
  }
  if (!run.state) return line_.Print(fmt::format("  {:<20} stopped before it began", run.name));
  const TrainState& s = *run.state;
  const Standing standing = Measure();
  line_.Print(fmt::format("  {:<20} {:>11} steps  {:>12}  {:<22}  {} of {} runs done{}", run.name,
                          FormatCount(s.steps), FormatDuration(s.seconds),
                          s.solved       ? "solved at " + FormatCount(s.streak_step)
                          : run.finished ? "done, not solved"
                                         : "stopped",
                          standing.done, runs_->size(),
                          standing.left > 0 ? ", " + standing.time_left : ""));
}

void ManyRunsView::PrintTable(const Variant& variant) const {
  Say("\n{}\n", Printable(variant.name.empty() ? many_.what : variant.name));
  std::vector<double> steps, seconds, success, reward;
  int64_t solved = 0, not_judged = 0, failed = 0;
  for (const SeedRun& run : *runs_) {
    if (run.variant != &variant) continue;
    if (!run.state || run.state->best_step == 0) {
      ++(run.problem.empty() ? not_judged : failed);
      continue;
    }
    if (steps.empty()) {
      Say("  {:<12} {:>11}  {:>12}  {:>7}  {:>8}\n", "", "solved at", "after", "success", "return");
    }
    const TrainState& s = *run.state;
    solved += s.solved ? 1 : 0;
    steps.push_back(s.solved ? static_cast<double>(s.streak_step) : kNever);
    seconds.push_back(s.solved ? s.streak_seconds : kNever);
    success.push_back(s.best_success_rate);
    reward.push_back(s.best_return);
    if (steps.size() > kMostRows) continue;
    PrintRow(fmt::format("seed {}", run.seed), steps.back(), seconds.back(), success.back(),
             reward.back(),
             !run.problem.empty() ? "failed"
             : run.finished       ? ""
                                  : fmt::format("at step {}", FormatCount(s.steps)));
  }
  if (steps.size() > kMostRows) Say("  and {} more\n", steps.size() - kMostRows);
  if (!steps.empty()) {
    PrintRow("median", QuartilesOf(steps).median, QuartilesOf(seconds).median,
             QuartilesOf(success).median, QuartilesOf(reward).median,
             fmt::format("{} of {} solved", solved, steps.size()));
  }
  if (not_judged > 0) Say("  {} not evaluated yet\n", Counted(not_judged, "run"));
  if (failed > 0) Say("  {} failed\n", Counted(failed, "run"));
}

size_t ManyRunsView::Left() const {
  return static_cast<size_t>(std::ranges::count_if(
      *runs_, [](const SeedRun& run) { return !run.finished && run.problem.empty(); }));
}

void ManyRunsView::SayStopped(size_t done) const {
  Say("Stopped, {} of {} runs done; the same command resumes them.\n", done, runs_->size());
}

void ManyRunsView::Finish() {
  const bool stopped = StopSignal() != 0;
  line_.Clear();
  for (const Variant& variant : plan_.variants) PrintTable(variant);
  const size_t done = Measure().done;
  Say("\nSuccess and return are those of each run's best policy at evaluation.\n");
  if (stopped) SayStopped(done);
  const bool can_be_typed = Printable(plan_.folder.string()) == plan_.folder.string();
  if (can_be_typed && (done < runs_->size() || !many_.compared)) {
    Say("Next:\n  ./upswing compare {}{}\n", ShellQuoted(plan_.folder.string()),
        done < runs_->size() ? " --unfinished" : "");
  }
  std::fflush(stdout);
}

}  // namespace upswing
