#pragma once

#include <cstdint>
#include <vector>

#include "runs/compare.h"
#include "runs/many_runs.h"

namespace upswing {

/// Prepares the folder and trains all unfinished runs, the first seed of each variant first. Uses
/// `jobs` worker processes (this program's `study --work`); workers on other hosts may help. Shows
/// progress, and a line for each finished run. Signals stop the runs.
///
/// Returns the exit code: 0, or 128 plus a stop signal. Throws Failure at the end if a run failed.
int TrainMany(const ManyRuns& many);

/// Says which finished seeds stay in the study although they were not asked for.
void SayKeptSeeds(const std::vector<int64_t>& seeds);

/// The comparison of the runs of a plan that are done.
Comparison CompareRuns(const StudyPlan& plan);

}  // namespace upswing
