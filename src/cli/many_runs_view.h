#pragma once

#include <string>
#include <vector>

#include "runs/many_runs.h"

/// Terminal output about many runs: a progress line, a line for each finished run, a table.
namespace upswing {

/// Trains many runs on this machine and shows progress. Signals stop the runs. Returns and throws
/// as TrainMany does.
int TrainManyAndShow(const ManyRuns& many);

/// Command-line options of a Slurm job array.
struct SlurmRequest {
  std::string options;  // for sbatch
  int64_t tasks = 0;    // workers; 0: one for each unfinished run, up to kMostSlurmTasks
};
inline constexpr int64_t kMostSlurmTasks = 100;  // default limit of tasks

/// The Slurm script for a plan's runs in their present state.
std::string SlurmScriptFor(const StudyPlan& plan, const std::vector<SeedRun>& runs,
                           const SlurmRequest& request);

/// Queues a job array whose tasks are the workers (many.jobs is 0), or finds the array that is
/// already queued, and shows the runs' progress. A signal to stop only ends the view.
int TrainOnSlurmAndShow(const ManyRuns& many, const SlurmRequest& request);

}  // namespace upswing
