#include "runs/study_worker.h"

#include <list>

#include "base/error.h"
#include "base/text.h"
#include "os/file.h"
#include "runs/lease.h"
#include "runs/run_folder.h"

namespace upswing {
namespace {

namespace fs = std::filesystem;

/// Removes the files of a finished run that `keep` does not keep.
void Reduce(const SeedRun& run, Keep keep) {
  if (keep == Keep::kAll) return;
  fs::remove(run.log());
  if (keep == Keep::kTables) return RemoveFolder(run.path);
  for (const auto& entry : fs::directory_iterator(run.path)) {
    const std::string name = entry.path().filename().string();
    const bool kept = name == RunFolder::kConfig || name == RunFolder::kPolicy ||
                      name == RunFolder::kEvaluations || name == RunFolder::kLog ||
                      name == RunFolder::kModel;
    if (!kept) fs::remove(entry.path());
  }
}

/// Writes the result file of a run and removes the files that are not kept. The caller must hold
/// the claim.
void Finish(const SeedRun& run, Keep keep) {
  const Config& config = run.variant->config;
  const auto at_end = ReadTrainState(run.path, config.Spec());
  if (!at_end)
    throw Failure(Concat(run.path.string(),
                         ": expected the run's folder, which was removed during the training"));
  const FinishedRun result{*at_end,
                           run.settings,
                           config.train.steps,
                           config.train.stop_when_solved,
                           UPSWING_VERSION,
                           RunConditions::Of(run.path),
                           ReadOwnFile(run.path / RunFolder::kEvaluations)};
  result.Write(run.done());
  Reduce(run, keep);
}

/// Begins a run, or resumes one that a worker left.
std::unique_ptr<TrainingRun> MakeOrResume(const SeedRun& run) {
  const TrainConfig& train = run.variant->config.train;
  // Training again gives the same bits.
  if (run.IsReduced() && fs::exists(run.path)) RemoveFolder(run.path);
  if (fs::exists(run.path / RunFolder::kConfig)) {
    return TrainingRun::Resume(
        run.path,
        {{"steps", std::to_string(train.steps), "steps"},
         {"threads", std::to_string(train.threads), "threads"},
         {"checkpoint_every", std::to_string(train.checkpoint_every), "checkpoint_every"},
         {"stop_when_solved", train.stop_when_solved ? "true" : "false", "stop_when_solved"}});
  }
  Config config = run.variant->config;
  config.train.seed = run.seed;
  return TrainingRun::Make(run.path, std::move(config));
}

/// Worker that trains the runs of a plan.
class Worker {
 public:
  Worker(const StudyPlan& plan, const TrainSeedRun& train, const std::function<bool()>& stopped)
      : plan_(plan), train_(train), stopped_(stopped) {}

  WorkerOutcome Run() {
    std::vector<SeedRun> runs = RunsOf(plan_);
    std::list<SeedRun*> open;
    for (SeedRun& run : runs) open.push_back(&run);
    // Repeat while a round trains a run, because another worker may have lost a run meanwhile.
    for (bool tried = true; tried && !open.empty() && !outcome_.stopped;) {
      tried = false;
      outcome_.claimed_by_others = 0;
      for (auto it = open.begin(); it != open.end() && !outcome_.stopped;) {
        const Turn turn = Try(**it);
        tried = tried || turn == Turn::kTried;
        if (turn == Turn::kClaimedByOthers) ++outcome_.claimed_by_others;
        it = turn == Turn::kClaimedByOthers ? std::next(it) : open.erase(it);
      }
    }
    return outcome_;
  }

 private:
  enum class Turn { kNothingToDo, kClaimedByOthers, kTried };

  Turn Try(SeedRun& run) {
    outcome_.stopped = stopped_();
    if (outcome_.stopped) return Turn::kNothingToDo;
    std::optional<Lease> lease;
    try {
      const bool ended = run.HasFailed() || run.ReadIfFinished();
      if (ended && !fs::exists(run.claim())) return Turn::kNothingToDo;
      if (auto taken = Lease::Take(run.claim(), "trains it")) lease.emplace(std::move(*taken));
      if (ended) return Turn::kNothingToDo;  // its worker died before it gave the claim back
      if (!lease) return Turn::kClaimedByOthers;
      // Another worker ended it meanwhile.
      if (run.HasFailed() || run.ReadIfFinished()) return Turn::kNothingToDo;
      Train(run, *lease);
    } catch (const FolderBusy&) {  // a worker that lost the claim is still running there
      return Turn::kClaimedByOthers;
    } catch (const std::exception& error) {
      if (lease && !lease->held()) return Turn::kClaimedByOthers;
      CountFailure(run, error);
    }
    return Turn::kTried;
  }

  /// Writes the reason of a run's failure. Throws Failure if that fails, or after several failures
  /// in a row, because a broken host must not fail all other runs.
  void CountFailure(const SeedRun& run, const std::exception& error) {
    constexpr int kMostInARow = 3;
    try {
      WriteFailed(run, error.what());
    } catch (const Error&) {
      throw Failure(Concat(run.name, ": ", error.what()));
    }
    ++outcome_.failed;
    if (++failed_in_a_row_ < kMostInARow) return;
    throw Failure(Concat(kMostInARow, " runs in a row failed on this worker; last ", run.name, ": ",
                         error.what()));
  }

  void Train(SeedRun& run, const Lease& lease) {
    run.Read();
    const auto make = [&] { return MakeOrResume(run); };
    if (!run.AtEnd() && !train_(run, make, [&] { return lease.held(); })) {
      outcome_.stopped = true;
      return;
    }
    if (!lease.held()) throw Failure("another worker has claimed the run");
    Finish(run, plan_.keep);
    ++outcome_.done;
    failed_in_a_row_ = 0;
  }

  const StudyPlan& plan_;
  const TrainSeedRun& train_;
  const std::function<bool()>& stopped_;
  WorkerOutcome outcome_;
  int failed_in_a_row_ = 0;
};

}  // namespace

void WriteEvaluations(const StudyPlan& plan) {
  std::string columns, table;
  for (const SeedRun& run : RunsOf(plan)) {
    const auto result = FinishedRun::Read(run.done());
    if (!result) continue;
    bool is_first = true;
    for (std::string_view rest = result->evaluations; !rest.empty();) {
      const std::string_view line = TakeLine(rest);
      if (line.empty()) continue;
      if (!is_first) {
        table += Concat(run.variant->name, ',', run.seed, ',', Printable(line), '\n');
      } else if (columns.empty()) {
        columns = Printable(line);
      } else if (columns != Printable(line)) {
        throw Failure(
            Concat(run.done().string(),
                   ": expected evaluations with the columns of the other runs, got others"));
      }
      is_first = false;
    }
  }
  WriteFileAtomically(plan.folder / "evaluations.csv",
                      Concat("variant,seed,", columns, "\n", table));
}

void WriteFailed(const SeedRun& run, const std::string& why) {
  WriteFileAtomically(run.failed(), Concat(Printable(why), "\n"));
}

WorkerOutcome WorkOn(const StudyPlan& plan, const TrainSeedRun& train,
                     const std::function<bool()>& stopped) {
  return Worker(plan, train, stopped).Run();
}

}  // namespace upswing
