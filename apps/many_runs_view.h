#pragma once

#include <string>
#include <vector>

#include "study/many_runs.h"

/// What people see of many runs: a progress line, a line for each that has ended, a table.
namespace upswing {

/// Trains many runs on this machine. Signals stop them. Returns and throws as TrainMany.
int TrainManyAndShow(const ManyRuns& many);

/// Options of a Slurm job array from the command line.
struct SlurmRequest {
  std::string options;  // of sbatch
  int64_t tasks = 0;    // workers; 0: one for each run that is not done, up to kMostSlurmTasks
};
inline constexpr int64_t kMostSlurmTasks = 100;  // unless told otherwise

/// The script for runs of a plan as they stand.
std::string SlurmScriptFor(const StudyPlan& plan, const std::vector<SeedRun>& runs,
                           const SlurmRequest& request);

/// Queues a job array whose tasks are the workers (many.jobs is 0), or finds the one that is queued
/// already, and shows how the runs go on. A signal to stop ends the view alone.
int TrainOnSlurmAndShow(const ManyRuns& many, const SlurmRequest& request);

}  // namespace upswing
