#pragma once

#include <cstdint>
#include <functional>
#include <string>
#include <vector>

#include "io/file.h"
#include "run/training_run.h"
#include "study/study_plan.h"

namespace upswing {

/// A plan that is carried out on this machine.
struct ManyRuns {
  StudyPlan plan;
  std::string what;                  // such as `d3qn` or a study's title
  std::string mark_file, mark_text;  // the file by which its folder is known; empty: settings.toml
  int64_t jobs = 1;                  // runs at a time; 0: none here, other workers have them
  bool more_steps = false;           // runs with fewer steps may be resumed
  bool compared = false;             // a comparison follows when all are done
};

/// Who is told how many runs go on, and asked whether to stop.
class ManyRunsObserver {
 public:
  virtual ~ManyRunsObserver() = default;

  /// All is checked and nothing touched; what is begun from here on should end in order.
  virtual void Prepare() {}
  /// These runs follow, and outlive the observer's last call.
  virtual void Begin(const std::vector<SeedRun>& runs) = 0;
  /// Called again and again, with those that run now.
  virtual void Watch(const std::vector<const SeedRun*>& running) = 0;
  /// A run has ended in any way.
  virtual void End(const SeedRun& run) = 0;
  /// All have ended, or were stopped.
  virtual void Finish() = 0;
  /// Whether the runs should write a checkpoint or stop; asked again and again.
  virtual TrainRequest Poll() = 0;
  /// The signal with which to stop them, such as SIGTERM; 0 as long as there is none.
  virtual int stop_signal() const = 0;
};

/// Makes the folder of a plan ready for workers, or that of the same runs, some of which may be
/// done. Those that failed are tried again. Returns the lock that keeps other calls from it. Throws
/// BadInput before anything is touched if the folder holds something else or runs of other
/// settings. `checked` is called when all is checked.
FolderLock Prepare(
    const ManyRuns& many, const std::function<void()>& checked = [] {});

/// Prepares, then trains all that is not finished, the first seed of each variant first, in `jobs`
/// worker processes (this program's `study --work`), beside those of other hosts if there are any.
/// Returns the exit code: 0, or 128 and a stop signal. Throws Failure at the end if a run failed.
int TrainMany(const ManyRuns& many, ManyRunsObserver& observer);

/// How many runs at a time are best, if each has so many threads.
int DefaultJobs(int64_t threads);

}  // namespace upswing
