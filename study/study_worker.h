#pragma once

#include <cstdint>
#include <functional>
#include <memory>

#include "run/training_run.h"
#include "study/study_plan.h"

namespace upswing {

/// What a worker that was told to stop ends with, as sysexits.h has it: try again later.
inline constexpr int kTryAgain = 75;

/// Who lets a worker's runs be seen, and may stop it.
class WorkerHost {
 public:
  virtual ~WorkerHost() = default;

  /// Makes or resumes a run and trains it to its end, or until it is to stop. Returns whether it
  /// has ended by itself. Throws, and writes nothing more, once it is no longer `ours`, which is to
  /// be asked after each step.
  virtual bool Train(const SeedRun& run, const std::function<std::unique_ptr<TrainingRun>()>& make,
                     const std::function<bool()>& ours) = 0;
  virtual bool stopped() = 0;
};

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
WorkerOutcome WorkOn(const StudyPlan& plan, WorkerHost& host);

/// Writes evaluations.csv into the folder of a plan: the rows of evals.csv of all runs that are
/// done, with their variant and seed.
void WriteEvaluations(const StudyPlan& plan);

/// Writes that a run has failed, and why.
void WriteFailed(const SeedRun& run, const std::string& why);

/// Writes that a run is done, and removes what is not to be kept of it. To be called with its
/// claim.
void Finish(const SeedRun& run, Keep keep);

}  // namespace upswing
