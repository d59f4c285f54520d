#pragma once

#include "runs/many_runs.h"

/// Terminal output about many runs: a progress line, a line for each finished run, a table.
namespace upswing {

/// Trains many runs on this machine and shows progress. Signals stop the runs. Returns and throws
/// as TrainMany does.
int TrainManyAndShow(const ManyRuns& many);

}  // namespace upswing
