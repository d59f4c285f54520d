#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "os/lock.h"
#include "runs/study_plan.h"

namespace upswing {

/// A plan that runs on this machine.
struct ManyRuns {
  StudyPlan plan;
  std::string what;         // name of the work, such as `d3qn` or a study's title
  std::string study_file;   // text for study.toml; empty: no such file
  int64_t jobs = 1;         // simultaneous runs
  bool more_steps = false;  // whether runs with fewer steps may be resumed
};

/// Prepares the folder of a plan for workers. The folder may already have the same runs, some of
/// them done; failed runs will be tried again. Returns a lock that keeps other calls away.
///
/// Throws BadInput, before it touches anything, if the folder holds something else or runs with
/// other settings.
FolderLock Prepare(const ManyRuns& many);

/// Adds the seeds of the plan `before` in the same folder for which all variants are finished, also
/// by the settings of `plan`: a run that would be continued is not added. Returns the added ones.
std::vector<int64_t> KeepFinishedSeeds(const StudyPlan& before, StudyPlan& plan);

/// Best number of simultaneous runs if each run has `threads` threads.
int DefaultJobs(int64_t threads);

}  // namespace upswing
