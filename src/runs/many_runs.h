#pragma once

#include <cstdint>
#include <functional>
#include <string>
#include <vector>

#include "os/file.h"
#include "runs/study_plan.h"
#include "runs/training_run.h"

namespace upswing {

/// Exit code of a worker that was told to stop: "try again later" in sysexits.h.
inline constexpr int kTryAgain = 75;

/// A plan that runs on this machine.
struct ManyRuns {
  StudyPlan plan;
  std::string what;         // name of the work, such as `d3qn` or a study's title
  std::string study_file;   // text for study.toml; empty: no such file
  int64_t jobs = 1;         // simultaneous runs
  bool more_steps = false;  // whether runs with fewer steps may be resumed
};

/// Observer of many runs. It also says when to stop.
class ManyRunsObserver {
 public:
  virtual ~ManyRunsObserver() = default;

  /// Called after all checks, before anything is touched. Work that begins after this call should
  /// end in order.
  virtual void Prepare() {}
  /// Called with all runs, which outlive the observer's last call.
  virtual void Begin(const std::vector<SeedRun>& runs) = 0;
  /// Called repeatedly with the runs that are in progress.
  virtual void Watch(const std::vector<const SeedRun*>& running) = 0;
  /// Called when a run has ended for any reason.
  virtual void End(const SeedRun& run) = 0;
  /// Called when all runs have ended or were stopped.
  virtual void Finish() = 0;
  /// Called repeatedly: whether the runs should go on, write a checkpoint or stop.
  virtual TrainRequest Poll() = 0;
  /// The signal that stops the runs, such as SIGTERM; 0 if there is none yet.
  virtual int stop_signal() const = 0;
};

/// Prepares the folder of a plan for workers. The folder may already have the same runs, some of
/// them done; failed runs will be tried again. Returns a lock that keeps other calls away.
///
/// Throws BadInput, before it touches anything, if the folder holds something else or runs with
/// other settings. Calls `checked` after all checks.
FolderLock Prepare(
    const ManyRuns& many, const std::function<void()>& checked = [] {});

/// Prepares the folder and trains all unfinished runs, the first seed of each variant first. Uses
/// `jobs` worker processes (this program's `study --work`); workers on other hosts may help.
/// Returns the exit code: 0, or 128 plus a stop signal. Throws Failure at the end if a run failed.
int TrainMany(const ManyRuns& many, ManyRunsObserver& observer);

/// Best number of simultaneous runs if each run has `threads` threads.
int DefaultJobs(int64_t threads);

}  // namespace upswing
