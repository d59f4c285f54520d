#pragma once

#include <cstdint>
#include <functional>
#include <memory>

#include "run/training_run.h"
#include "study/study_plan.h"

namespace upswing {

/// What a worker that was told to stop ends with, as sysexits.h has it: try again later.
inline constexpr int kTryAgain = 75;

/// Trains a run, which `make` makes or resumes, to its end or until a signal stops it. Calls `ours`
/// after each step and, once that returns false, throws and writes nothing more. Returns whether
/// the training has ended.
using TrainSeedRun = std::function<bool(const SeedRun& run,
                                        const std::function<std::unique_ptr<TrainingRun>()>& make,
                                        const std::function<bool()>& ours)>;

/// How a worker ended.
struct WorkerOutcome {
  int64_t done = 0, failed = 0;   // runs
  int64_t claimed_by_others = 0;  // runs that other workers train
  bool stopped = false;
};

/// Trains the runs of a plan that are not done, one after the other, beside any number of other
/// workers on this host and others: each claims a run before it works on it. Ends when there is
/// none that it could claim. A run that another worker left is resumed from its checkpoint. Of a
/// run that fails the reason is written beside it, and no worker tries it again until the study is
/// begun anew. A run that was done twice does no harm: its bits are the same. Throws Failure if
/// several runs in a row failed here, or if nothing can be written.
/// Begins no other run once `stopped` returns true.
WorkerOutcome WorkOn(const StudyPlan& plan, const TrainSeedRun& train,
                     const std::function<bool()>& stopped);

/// Writes evaluations.csv into the folder of a plan: the rows of evals.csv of all runs that are
/// done, with their variant and seed.
void WriteEvaluations(const StudyPlan& plan);

/// Writes that a run has failed, and why.
void WriteFailed(const SeedRun& run, const std::string& why);

}  // namespace upswing
