#pragma once

#include <cstdint>
#include <functional>
#include <memory>

#include "runs/study_plan.h"
#include "runs/training_run.h"

namespace upswing {

/// Exit code of a worker that was told to stop: "try again later" in sysexits.h.
inline constexpr int kTryAgain = 75;

/// Trains a run to its end or until a signal stops it. `make` makes or resumes the run. Calls
/// `ours` after each step; once that returns false, throws and writes nothing more. Returns whether
/// the training has ended.
using TrainSeedRun = std::function<bool(const SeedRun& run,
                                        const std::function<std::unique_ptr<TrainingRun>()>& make,
                                        const std::function<bool()>& ours)>;

/// Result of a worker.
struct WorkerOutcome {
  int64_t done = 0, failed = 0;   // number of runs
  int64_t claimed_by_others = 0;  // runs that other workers train
  bool stopped = false;
};

/// Trains the unfinished runs of a plan one after the other. Any number of workers on this host and
/// others can do so at the same time: each claims a run before it works on it. Ends when no run is
/// left to claim.
///
/// Resumes a run that another worker left from its checkpoint. If a run fails, writes the reason
/// next to it; no worker tries that run again until the study is started again. A run that is done
/// twice does no harm, because its bits are the same.
///
/// Begins no new run once `stopped` returns true. Throws Failure if several runs in a row fail
/// here, or if nothing can be written.
WorkerOutcome WorkOn(const StudyPlan& plan, const TrainSeedRun& train,
                     const std::function<bool()>& stopped);

/// Writes evaluations.csv into the folder of a plan: the rows of evals.csv of all finished runs,
/// with variant and seed.
void WriteEvaluations(const StudyPlan& plan);

/// Writes the reason of a run's failure to its file failed().
void WriteFailed(const SeedRun& run, const std::string& why);

}  // namespace upswing
