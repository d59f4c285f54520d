#include "lab/study_worker.h"

#include <algorithm>
#include <list>

#include "core/error.h"
#include "core/text.h"
#include "io/file.h"
#include "io/lease.h"
#include "io/run_folder.h"

namespace upswing {
namespace {

namespace fs = std::filesystem;

/// Removes the files of a finished run but those that are to be kept.
void Reduce(const SeedRun& run, Keep keep) {
  if (keep == Keep::kAll) return;
  std::error_code error;
  fs::remove(run.log(), error);
  if (keep == Keep::kTables) {
    fs::remove_all(run.path, error);
    return;
  }
  for (const auto& entry : fs::directory_iterator(run.path, error)) {
    const std::string name = entry.path().filename().string();
    const bool kept = name == RunFolder::kConfig || name == RunFolder::kPolicy ||
                      name == RunFolder::kEvaluations || name == RunFolder::kLog ||
                      name == RunFolder::kModel;
    if (!kept) fs::remove(entry.path(), error);
  }
}

/// Begins a run, or resumes what a worker left of it.
std::unique_ptr<TrainingRun> MakeOrResume(const SeedRun& run) {
  const TrainConfig& train = run.variant->config.train;
  if (run.IsReduced()) fs::remove_all(run.path);  // the same bits come again
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

/// One worker.
class Worker {
 public:
  Worker(const StudyPlan& plan, WorkerHost& host) : plan_(plan), host_(host) {}

  WorkerOutcome Run() {
    std::vector<SeedRun> runs = RunsOf(plan_);
    std::list<SeedRun*> open;
    for (SeedRun& run : runs) open.push_back(&run);
    // Again, as long as that brings any: another worker may have lost one meanwhile.
    for (bool claimed = true; claimed && !open.empty() && !outcome_.stopped;) {
      claimed = false;
      for (auto it = open.begin(); it != open.end() && !outcome_.stopped;) {
        const Turn turn = Try(**it);
        claimed = claimed || turn == Turn::kClaimed;
        it = turn == Turn::kAnothers ? std::next(it) : open.erase(it);
      }
    }
    return outcome_;
  }

 private:
  enum class Turn { kNothingToDo, kAnothers, kClaimed };

  Turn Try(SeedRun& run) {
    outcome_.stopped = host_.stopped();
    if (outcome_.stopped) return Turn::kNothingToDo;
    try {
      const bool ended = HasEnded(run);
      if (ended && !fs::exists(run.claim())) return Turn::kNothingToDo;
      const std::optional<Lease> lease = Lease::Take(run.claim(), "trains it");
      if (ended) return Turn::kNothingToDo;  // its worker died before it gave the claim back
      if (!lease) return Turn::kAnothers;
      if (HasEnded(run)) return Turn::kNothingToDo;  // meanwhile
      Train(run, *lease);
    } catch (const std::exception& error) {
      ++outcome_.failed;
      WriteFailed(run, error.what());
    }
    return Turn::kClaimed;
  }

  /// Whether it is done or has failed.
  static bool HasEnded(SeedRun& run) {
    std::error_code error;
    return fs::exists(fs::symlink_status(run.failed(), error)) || run.ReadDoneResult();
  }

  void Train(SeedRun& run, const Lease& lease) {
    run.Read();
    if (!run.finished() && !host_.Train(run, [&] { return MakeOrResume(run); })) {
      outcome_.stopped = true;
      return;
    }
    // Halted for long, it may have lost the run to another worker, who goes on with it.
    if (!lease.held()) return;
    Finish(run, plan_.keep);
    ++outcome_.done;
  }

  const StudyPlan& plan_;
  WorkerHost& host_;
  WorkerOutcome outcome_;
};

}  // namespace

void WriteEvaluations(const StudyPlan& plan) {
  std::string columns, table;
  for (const SeedRun& run : RunsOf(plan)) {
    const auto result = ReadDone(run.done());
    if (!result) continue;
    bool is_first = true;
    for (const std::string_view line : Split(result->evaluations, '\n')) {
      if (line.empty()) continue;
      if (!is_first) {
        table += Concat(run.variant->name, ',', run.seed, ',', line, '\n');
      } else if (columns.empty()) {
        columns = line;
      } else if (columns != line) {
        throw Failure(Concat(run.done().string(),
                             ": its evaluations have other columns than those ", "of other runs"));
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

WorkerOutcome WorkOn(const StudyPlan& plan, WorkerHost& host) { return Worker(plan, host).Run(); }

void Finish(const SeedRun& run, Keep keep) {
  const auto at_end = ReadCheckpointResult(run.path, SpecOf(run.variant->config.Environments()));
  if (!at_end) throw Failure(Concat(run.path.string(), ": it was removed while it was trained"));
  RunResult result = *at_end;
  result.settings = run.settings;
  result.planned_steps = run.variant->config.train.steps;
  result.stop_when_solved = run.variant->config.train.stop_when_solved;
  result.version = UPSWING_VERSION;
  result.conditions = ReadConditions(run.path);
  result.evaluations = ReadOwnFile(run.path / RunFolder::kEvaluations);
  WriteDone(run.done(), result);
  Reduce(run, keep);
}

}  // namespace upswing
