#include "cli/many_runs_view.h"

#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <cstdio>

#include "agents/config_checks.h"
#include "base/format.h"
#include "base/text.h"
#include "cli/progress.h"
#include "cli/say.h"
#include "cli/signals.h"
#include "runs/seeds.h"

namespace upswing {
namespace {

/// The printed view of many runs: a progress line, and a line per finished run. Signals stop the
/// runs.
class ManyRunsView : public ManyRunsObserver {
 public:
  /// The plan must outlive the view.
  explicit ManyRunsView(const ManyRuns& many) : many_(many) {}

  void Prepare() override { InstallSignalHandlers(kStoppingTraining); }
  /// Prints variants, seeds and folder. From here on, the rate counts steps.
  void Begin(const std::vector<SeedRun>& runs) override {
    runs_ = &runs;
    steps_before_ = Measure().steps;
    Announce();
  }

  void Watch(const std::vector<const SeedRun*>& running) override {
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

  void End(const SeedRun& run) override {
    if (!run.problem.empty()) {
      return line_.Print(fmt::format("  {:<20} failed: {} (log: {})", run.name,
                                     Printable(run.problem), Printable(run.log().string())));
    }
    if (!run.state)
      return line_.Print(fmt::format("  {:<20} stopped before its first step", run.name));
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

  /// If runs are left, prints how many are done and the next command to type.
  void Finish() override {
    line_.Clear();
    const size_t done = Measure().done;
    if (StopSignal() != 0) {
      Say("Stopped with {} of {} runs done; the same command resumes the others.\n", done,
          runs_->size());
    }
    const std::string folder = many_.plan.folder.string();
    if (done < runs_->size() && Printable(folder) == folder) {
      Say("Next:\n  {} compare {} --unfinished\n", LaunchCommand(), ShellQuoted(folder));
    }
    std::fflush(stdout);
  }

  TrainRequest Poll() override { return PollSignals(); }
  int stop_signal() const override { return StopSignal(); }

 private:
  /// Progress over all runs.
  struct Standing {
    size_t done = 0;             // finished runs
    double steps = 0, left = 0;  // made; at most to be made
    double share = 0;            // of the work, 0 to 1
    double steps_per_second = 0;
    std::string time_left;  // such as `at most 3 min 20 s left`
  };

  Standing Measure() const {
    Standing standing;
    for (const SeedRun& run : *runs_) {
      // Reads only the files of running runs, because there may be thousands of others.
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

  void Announce() const {
    const size_t variants = many_.plan.variants.size();
    Say("Training {} in {}\n", Printable(many_.what), Printable(many_.plan.folder.string()));
    Say("  {}seed{} {}: {}{}\n", variants == 1 ? "" : fmt::format("{} variants, ", variants),
        many_.plan.seeds.size() == 1 ? "" : "s", SeedsText(many_.plan.seeds),
        Counted(std::ssize(*runs_), "run"), fmt::format(", {} at a time", many_.jobs));
    for (const Variant& variant : many_.plan.variants) {
      for (const std::string& warning : Warnings(variant.config)) {
        Say("  Warning: {}{}{}\n", Printable(variant.name), variant.name.empty() ? "" : ": ",
            warning);
      }
    }
    const auto begun =
        std::ranges::count_if(*runs_, [](const SeedRun& run) { return run.state.has_value(); });
    if (begun > 0) {
      const size_t done = Measure().done;
      Say("  {} already done, resuming {}\n", done, static_cast<size_t>(begun) - done);
    }
    const auto reduced = std::ranges::count_if(
        *runs_, [](const SeedRun& run) { return !run.finished && run.IsReduced(); });
    if (reduced > 0) {
      Say("  {} finished with fewer steps: trained again from the start, because no checkpoint is "
          "kept\n",
          reduced);
    }
    for (const SeedRun& run : *runs_) {
      if (!run.problem.empty()) Say("  {:<20} failed: {}\n", run.name, Printable(run.problem));
    }
    std::fflush(stdout);
  }

  const ManyRuns& many_;
  ProgressLine line_;
  const std::vector<SeedRun>* runs_ = nullptr;
  std::vector<const SeedRun*> running_;
  double steps_before_ = 0;  // made before this process began
  std::chrono::steady_clock::time_point begin_ = std::chrono::steady_clock::now();
};

}  // namespace

int TrainManyAndShow(const ManyRuns& many) {
  ManyRunsView view(many);
  return TrainMany(many, view);
}

Comparison CompareRuns(const StudyPlan& plan) {
  CompareRequest request;
  request.root = plan.folder;
  request.different_tasks = true;
  for (const SeedRun& run : RunsOf(plan)) request.paths.push_back(run.path);
  return Compare(request);
}

}  // namespace upswing
