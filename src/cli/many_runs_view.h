#pragma once

#include "runs/compare.h"
#include "runs/many_runs.h"

/// Terminal output about many runs: a progress line, and a line for each finished run.
namespace upswing {

/// Trains many runs on this machine and shows progress. Signals stop the runs. Returns and throws
/// as TrainMany does.
int TrainManyAndShow(const ManyRuns& many);

/// The comparison of the runs of a plan that are done.
Comparison CompareRuns(const StudyPlan& plan);

}  // namespace upswing
