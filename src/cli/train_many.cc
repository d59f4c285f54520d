#include "cli/train_many.h"

#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <cstdio>
#include <list>
#include <map>
#include <thread>
#include <utility>

#include "agents/config_checks.h"
#include "base/error.h"
#include "base/format.h"
#include "base/stopwatch.h"
#include "base/text.h"
#include "cli/progress.h"
#include "cli/say.h"
#include "cli/signals.h"
#include "cli/study_work.h"
#include "os/child_process.h"
#include "os/file.h"
#include "os/lock.h"
#include "runs/seeds.h"

namespace upswing {
namespace {

namespace fs = std::filesystem;

/// The printed view of many runs: a progress line, and a line per finished run.
class ManyRunsView {
 public:
  /// Prints variants, seeds and folder. Plan and runs must outlive the view.
  ManyRunsView(const ManyRuns& many, const std::vector<SeedRun>& runs) : many_(many), runs_(runs) {
    steps_before_ = Measure().steps;
    Announce();
  }

  /// Shows the progress, given the runs that are in progress.
  void Watch(const std::vector<SeedRun*>& running) {
    running_ = running;
    if (!line_.due()) return;
    const Standing standing = Measure();
    std::vector<std::string> fields{
        fmt::format("{} of {} runs", standing.done, runs_.size()), standing.time_left,
        fmt::format("{} steps/s", FormatCount(std::max(0.0, standing.steps_per_second)))};
    for (const SeedRun* run : running) {
      const auto all = static_cast<double>(run->variant->config.train.steps);
      fields.push_back(
          fmt::format("{} {:.0f}%", run->name, 100 * static_cast<double>(run->Steps()) / all));
    }
    line_.Show(standing.share, fields);
  }

  /// Prints how a run has ended.
  void End(const SeedRun& run) {
    if (!run.problem.empty()) {
      return line_.Print(fmt::format("  {:<20} failed: {} (log: {})", run.name,
                                     Printable(run.problem), Printable(run.log().string())));
    }
    if (!run.state) {
      return line_.Print(fmt::format("  {:<20} stopped before its first step", run.name));
    }
    const TrainState& s = *run.state;
    std::string end = "stopped";
    if (run.finished) end = "done, not solved";
    if (s.solved) end = "solved at " + FormatCount(s.streak_step);
    const Standing standing = Measure();
    std::string all = fmt::format("{} of {} runs done", standing.done, runs_.size());
    if (standing.left > 0) all += ", " + standing.time_left;
    line_.Print(fmt::format("  {:<20} {:>11} steps  {:>12}  {:<22}  {}", run.name,
                            FormatCount(s.steps), FormatDuration(s.seconds), end, all));
  }

  /// If runs are left, prints how many are done and the next command to type.
  void Finish() {
    line_.Clear();
    const size_t done = Measure().done;
    if (StopSignal() != 0) {
      Say("Stopped with {} of {} runs done; the same command resumes the others.\n", done,
          runs_.size());
    }
    const std::string folder = many_.plan.folder.string();
    if (done < runs_.size() && Printable(folder) == folder) {
      Say("Next:\n  {} compare {} --unfinished\n", LaunchCommand(), ShellQuoted(folder));
    }
    std::fflush(stdout);
  }

 private:
  /// Progress over all runs.
  struct Standing {
    size_t done = 0;             // finished runs
    double steps = 0, left = 0;  // made; at most to be made
    double share = 0;            // of the work, 0 to 1
    double steps_per_second = 0;
    std::string time_left;  // such as `at most 3 min 20 s left`
  };

  /// Steps that a run has made. Reads only the files of running runs, because there may be
  /// thousands of others.
  int64_t StepsOf(const SeedRun& run) const {
    if (std::ranges::find(running_, &run) != running_.end()) return run.Steps();
    return run.state ? run.state->steps : 0;
  }

  Standing Measure() const {
    Standing standing;
    for (const SeedRun& run : runs_) {
      const auto steps = static_cast<double>(StepsOf(run));
      standing.steps += steps;
      if (run.finished) ++standing.done;
      if (run.finished || !run.problem.empty()) continue;
      standing.left += std::max(0.0, static_cast<double>(run.variant->config.train.steps) - steps);
    }
    const double all = standing.steps + standing.left;
    standing.share = all > 0 ? standing.steps / all : 1;
    standing.steps_per_second = (standing.steps - steps_before_) / std::max(1e-3, watch_.seconds());
    const bool may_end_early = std::ranges::any_of(
        runs_, [](const SeedRun& run) { return run.variant->config.train.stop_when_solved; });
    std::string duration = "?";
    if (standing.steps_per_second > 0) {
      duration = FormatDuration(standing.left / standing.steps_per_second);
    }
    standing.time_left = fmt::format("{} {} left", may_end_early ? "at most" : "about", duration);
    return standing;
  }

  void Announce() const {
    const size_t variants = many_.plan.variants.size();
    Say("Training {} in {}\n", Printable(many_.what), Printable(many_.plan.folder.string()));
    const std::string of_variants = variants > 1 ? fmt::format("{} variants, ", variants) : "";
    const char* seeds = many_.plan.seeds.size() == 1 ? "seed" : "seeds";
    Say("  {}{} {}: {}, {} at a time\n", of_variants, seeds, SeedsText(many_.plan.seeds),
        Counted(std::ssize(runs_), "run"), many_.jobs);
    for (const Variant& variant : many_.plan.variants) {
      for (const std::string& warning : Warnings(variant.config)) {
        Say("  Warning: {}{}{}\n", Printable(variant.name), variant.name.empty() ? "" : ": ",
            warning);
      }
    }
    const auto begun =
        std::ranges::count_if(runs_, [](const SeedRun& run) { return run.state.has_value(); });
    if (begun > 0) {
      const size_t done = Measure().done;
      Say("  {} already done, resuming {}\n", done, static_cast<size_t>(begun) - done);
    }
    const auto reduced = std::ranges::count_if(
        runs_, [](const SeedRun& run) { return !run.finished && run.IsReduced(); });
    if (reduced > 0) {
      Say("  {} finished with fewer steps: trained again from the start, because no checkpoint is "
          "kept\n",
          reduced);
    }
    for (const SeedRun& run : runs_) {
      if (!run.problem.empty()) Say("  {:<20} failed: {}\n", run.name, Printable(run.problem));
    }
    std::fflush(stdout);
  }

  const ManyRuns& many_;
  ProgressLine line_;
  const std::vector<SeedRun>& runs_;
  std::vector<SeedRun*> running_;
  double steps_before_ = 0;  // made before this process began
  Stopwatch watch_;
};

/// The last line of a log file that is not empty.
std::string LastLine(const fs::path& path) {
  std::string last = "its log is empty";
  const std::string text = ReadEnd(path, 1 << 16);
  for (const std::string_view line : Split(text, '\n')) {
    if (!line.empty()) last = line;
  }
  constexpr std::string_view kProgram = "upswing: ";  // the caller's message begins with it, too
  return last.starts_with(kProgram) ? last.substr(kProgram.size()) : last;
}

/// The worker processes on this machine, and the progress of all runs.
class LocalWorkers {
 public:
  LocalWorkers(const ManyRuns& many, std::vector<SeedRun>& runs, ManyRunsView& view)
      : many_(many), view_(view), log_(many.plan.folder / "workers.log") {
    for (SeedRun& run : runs) {
      if (!run.finished && run.problem.empty()) open_.push_back(&run);
    }
  }

  /// Returns when all runs have ended. After a request to stop, returns when the workers have
  /// ended.
  void Run() {
    while (true) {
      const TrainRequest request = PollSignals();
      if (request == TrainRequest::kCheckpoint) SignalAll(kCheckpointSignal);
      if (request == TrainRequest::kStop && !stopping_) {
        stopping_ = true;
        SignalAll(StopSignal());
      }
      Reap();
      if (const auto now = Clock::now(); now >= look_at_) {
        Look();
        look_at_ = now + (open_.size() < 1000 ? kOften : kSeldom);
        if (!stopping_) StartWorkers(now);
      }
      if (workers_.empty() && (stopping_ || open_.empty())) break;
      view_.Watch(running_);
      std::this_thread::sleep_for(std::chrono::milliseconds(20));
    }
    Look();
    for (SeedRun* run : running_) {                  // runs of stopped workers
      if (FileLock::IsHeld(run->claim())) continue;  // the run continues on another host
      run->Read();
      view_.End(*run);
    }
    std::error_code error;
    if (deaths_.empty()) fs::remove(log_, error);  // otherwise it may contain the reason
  }

 private:
  using Clock = std::chrono::steady_clock;
  static constexpr std::chrono::milliseconds kOften{60}, kSeldom{500};

  /// Removes the workers that have ended from the list.
  void Reap() {
    for (auto it = workers_.begin(); it != workers_.end();) {
      const int64_t pid = it->pid();
      const auto code = it->Poll();
      const bool as_asked = stopping_ && code == 128 + StopSignal();
      if (code && *code != 0 && *code != 1 && *code != kTryAgain && !as_asked) {
        EndedBadly(pid, *code);
      }
      it = code ? workers_.erase(it) : std::next(it);
    }
  }

  /// Leaves the run of a worker that died to another worker. A run whose workers die twice has
  /// failed.
  void EndedBadly(int64_t pid, int code) {
    constexpr int kMostDeaths = 2;
    const auto how = [code](const fs::path& log) {
      return code > 128 ? Concat("ended by signal ", code - 128) : LastLine(log);
    };
    const std::string holder = FileLock::Holder(pid);
    for (const SeedRun* run : open_) {
      if (ReadEnd(run->claim(), 1024) != holder) continue;
      if (++deaths_[run] < kMostDeaths) return;
      const FileLock claim(run->claim());
      if (claim.held()) run->WriteFailed(how(run->log()));
      return;
    }
    if (++deaths_[nullptr] < kMostDeaths) return;  // the worker died between two runs
    throw Failure(Concat("a worker ended: ", how(log_)));
  }

  /// Finds out which runs have ended, are running or wait. Runs begin in order, so it stops after
  /// many waiting runs.
  void Look() {
    constexpr int kEnough = 64;
    const std::vector<SeedRun*> before = std::exchange(running_, {});
    waiting_ = 0;
    for (auto it = open_.begin(); it != open_.end() && waiting_ < kEnough;) {
      SeedRun& run = **it;
      if (Exists(run.done()) || run.HasFailed()) run.Refresh();
      if (run.finished || !run.problem.empty()) {
        it = open_.erase(it);
        view_.End(run);
        continue;
      }
      // Run prints the runs of stopped workers.
      const bool until_now = stopping_ && std::ranges::find(before, &run) != before.end();
      if (until_now || FileLock::IsHeld(run.claim())) {
        running_.push_back(&run);
      } else {
        ++waiting_;
      }
      ++it;
    }
  }

  /// Starts workers for waiting runs.
  void StartWorkers(Clock::time_point now) {
    const auto jobs = static_cast<size_t>(many_.jobs);
    if (workers_.size() >= jobs || now < start_at_) return;
    const size_t wanted = std::min(jobs - workers_.size(), waiting_);
    for (size_t i = 0; i < wanted; ++i) {
      workers_.emplace_back(std::vector<std::string>{"study", "--work", many_.plan.folder.string()},
                            log_);
    }
    start_at_ = now + std::chrono::seconds(1);  // workers need time to claim their runs
  }

  void SignalAll(int signal) {
    for (const ChildProcess& worker : workers_) worker.Signal(signal);
  }

  const ManyRuns& many_;
  ManyRunsView& view_;
  fs::path log_;
  std::list<SeedRun*> open_;  // runs that are neither done nor failed
  std::vector<SeedRun*> running_;
  size_t waiting_ = 0;  // unclaimed runs
  std::list<ChildProcess> workers_;
  std::map<const SeedRun*, int> deaths_;  // deaths of workers per run; null: between runs
  Clock::time_point look_at_{}, start_at_{};
  bool stopping_ = false;
};

}  // namespace

int TrainMany(const ManyRuns& many) {
  InstallSignalHandlers(kStoppingTraining);
  const FolderLock lock = Prepare(many);
  std::vector<SeedRun> runs = RunsOf(many.plan);
  for (SeedRun& run : runs) {
    run.Refresh();
    if (!run.problem.empty()) run.WriteFailed(run.problem);
  }
  ManyRunsView view(many, runs);
  LocalWorkers(many, runs, view).Run();
  view.Finish();

  if (StopSignal() != 0) return 128 + StopSignal();
  const size_t all = runs.size();
  std::erase_if(runs, [](const SeedRun& run) { return run.problem.empty(); });
  if (runs.empty()) return 0;
  throw Failure(Concat(runs.size(), " of ", all, " runs in ", many.plan.folder.string(),
                       " failed; first ", runs.front().name, ": ", runs.front().problem));
}

void SayKeptSeeds(const std::vector<int64_t>& seeds) {
  if (seeds.empty()) return;
  Say("Finished seeds stay in the tables, too: {}\n", SeedsText(seeds));
}

Comparison CompareRuns(const StudyPlan& plan) {
  CompareRequest request{.root = plan.folder, .different_tasks = true};
  for (const SeedRun& run : RunsOf(plan)) request.paths.push_back(run.path.string());
  return Compare(request);
}

}  // namespace upswing
