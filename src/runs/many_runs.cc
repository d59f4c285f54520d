#include "runs/many_runs.h"

#include <algorithm>
#include <chrono>
#include <csignal>
#include <list>
#include <map>
#include <thread>

#include "base/error.h"
#include "base/text.h"
#include "os/child_process.h"
#include "os/file.h"
#include "os/host.h"
#include "runs/config_files.h"
#include "runs/run_folder.h"

namespace upswing {
namespace {

namespace fs = std::filesystem;

constexpr const char* kWorkersLog = "workers.log";

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

// ---- Checks before anything runs.

/// Throws BadInput if `what`, made with the settings `before`, cannot be resumed with the settings
/// `now`.
void CheckSame(Config before, const Config& now, bool more_steps, const std::string& what) {
  if (more_steps) before.train.steps = std::max(before.train.steps, now.train.steps);
  const auto counts = [](const Option& option) {
    return option.decides == Option::Decides::kTraining || option.decides == Option::Decides::kEnd;
  };
  try {
    ExpectSameSettings(before, now, what, counts);
  } catch (const Error& other) {
    throw BadInput(Concat(other.what(), "; choose another --out"));
  }
}

/// Throws BadInput if a run in a variant's folder, or the folder's settings file, has other
/// settings.
void CheckRuns(const fs::path& folder, const Config& config, bool more_steps) {
  std::error_code error;
  const std::string mark = SettingsMark(config);
  for (const auto& entry : fs::directory_iterator(folder, error)) {
    if (IsMakingName(entry.path().filename().string())) continue;
    if (!IsFile(entry.path() / RunFolder::kConfig)) continue;
    const auto done = FinishedRun::Read(entry.path().string() + ".done");
    const bool same = done && done->settings == mark && done->version == UPSWING_VERSION &&
                      done->planned_steps == config.train.steps &&
                      done->stop_when_solved == config.train.stop_when_solved;
    if (!same) CheckSame(ReadRunConfig(entry.path()), config, more_steps, entry.path().string());
  }
  const fs::path settings = folder / kSettingsName;
  if (!IsFile(settings)) return;
  CheckSame(ReadSettings(settings), config, more_steps, settings.string());
}

/// All runs in their current state.
std::vector<SeedRun> ListRuns(const StudyPlan& plan) {
  std::vector<SeedRun> runs = RunsOf(plan);
  for (SeedRun& run : runs) {
    run.Refresh();
    if (!run.problem.empty() && !run.HasFailed()) run.WriteFailed(run.problem);
  }
  return runs;
}

// ---- Supervision of the running workers.

/// The worker processes on this machine, and the progress of all runs.
class LocalWorkers {
 public:
  LocalWorkers(const ManyRuns& many, std::vector<SeedRun>& runs, ManyRunsObserver& observer)
      : many_(many), observer_(observer), log_(many.plan.folder / kWorkersLog) {
    for (SeedRun& run : runs) {
      if (!run.finished && run.problem.empty()) open_.push_back(&run);
    }
  }

  /// Returns when all runs have ended. After a request to stop, returns when the workers have
  /// ended.
  void Run() {
    while (true) {
      const TrainRequest request = observer_.Poll();
      if (request == TrainRequest::kCheckpoint) SignalAll(SIGUSR1);
      if (request == TrainRequest::kStop && !stopping_) {
        stopping_ = true;
        SignalAll(observer_.stop_signal());
      }
      Reap();
      if (const auto now = Clock::now(); now >= look_at_) {
        Look();
        look_at_ = now + (open_.size() < 1000 ? kOften : kSeldom);
        if (!stopping_) StartWorkers(now);
      }
      if (workers_.empty() && (stopping_ || open_.empty())) break;
      observer_.Watch(running_);
      std::this_thread::sleep_for(std::chrono::milliseconds(20));
    }
    Look();
    for (const SeedRun* run : running_) {            // runs of stopped workers
      if (FileLock::IsHeld(run->claim())) continue;  // the run continues on another host
      auto* stopped = *std::ranges::find(open_, run);
      stopped->Read();
      observer_.End(*stopped);
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
      const pid_t pid = it->pid();
      const auto code = it->Poll();
      const bool as_asked = stopping_ && code == 128 + observer_.stop_signal();
      if (code && *code != 0 && *code != 1 && *code != kTryAgain && !as_asked) {
        EndedBadly(pid, *code);
      }
      it = code ? workers_.erase(it) : std::next(it);
    }
  }

  /// Leaves the run of a worker that died to another worker. A run whose workers die twice has
  /// failed.
  void EndedBadly(pid_t pid, int code) {
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
    std::vector<const SeedRun*> before = std::move(running_);
    running_.clear();
    waiting_ = 0;
    for (auto it = open_.begin(); it != open_.end() && waiting_ < kEnough;) {
      SeedRun& run = **it;
      if (Exists(run.done()) || run.HasFailed()) run.Refresh();
      if (run.finished || !run.problem.empty()) {
        it = open_.erase(it);
        observer_.End(run);
        continue;
      }
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
    if (workers_.size() >= jobs || open_.empty() || now < start_at_) return;
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
  ManyRunsObserver& observer_;
  fs::path log_;
  std::list<SeedRun*> open_;  // runs that are neither done nor failed
  std::vector<const SeedRun*> running_;
  size_t waiting_ = 0;  // unclaimed runs
  std::list<ChildProcess> workers_;
  std::map<const SeedRun*, int> deaths_;  // deaths of workers per run; null: between runs
  Clock::time_point look_at_{}, start_at_{};
  bool stopping_ = false;
};

}  // namespace

FolderLock Prepare(const ManyRuns& many, const std::function<void()>& checked) {
  // Touch nothing before all checks have passed, nor while another process works there.
  const StudyPlan& plan = many.plan;
  if (!IsFile(plan.folder / kPlanName)) {
    CheckFree(plan.folder,
              Concat("it has no ", kPlanName, " to resume from; choose another --out"));
  }
  std::optional<FolderLock> lock;
  if (Exists(plan.folder)) lock.emplace(plan.folder);
  for (const Variant& variant : plan.variants) {
    const fs::path folder = plan.folder / variant.name;
    if (!variant.name.empty()) CheckNoLink(folder);
    CheckRuns(folder, variant.config, many.more_steps);
  }
  checked();
  WritePlan(plan);
  if (!many.study_file.empty()) WriteIfOther(plan.folder / "study.toml", many.study_file);
  for (const SeedRun& run : RunsOf(plan)) fs::remove(run.failed());  // so that it is tried again
  return lock ? std::move(*lock) : FolderLock(plan.folder);
}

int TrainMany(const ManyRuns& many, ManyRunsObserver& observer) {
  const FolderLock lock = Prepare(many, [&] { observer.Prepare(); });
  std::vector<SeedRun> runs = ListRuns(many.plan);
  observer.Begin(runs);
  LocalWorkers(many, runs, observer).Run();
  observer.Finish();

  if (observer.stop_signal() != 0) return 128 + observer.stop_signal();
  const size_t all = runs.size();
  std::erase_if(runs, [](const SeedRun& run) { return run.problem.empty(); });
  if (runs.empty()) return 0;
  throw Failure(Concat(runs.size(), " of ", all, " runs in ", many.plan.folder.string(),
                       " failed; first ", runs.front().name, ": ", runs.front().problem));
}

int DefaultJobs(int64_t threads) {
  return std::max(1, UsableProcessors() / static_cast<int>(std::max<int64_t>(1, threads)));
}

}  // namespace upswing
