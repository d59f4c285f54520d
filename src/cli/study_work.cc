#include "cli/study_work.h"

#include <fmt/format.h>

#include <cstdio>
#include <map>
#include <nlohmann/json.hpp>
#include <optional>

#include "base/error.h"
#include "base/format.h"
#include "base/json.h"
#include "base/text.h"
#include "cli/say.h"
#include "cli/signals.h"
#include "cli/train_view.h"
#include "os/file.h"
#include "os/lock.h"
#include "os/terminal.h"
#include "runs/run_folder.h"
#include "runs/study_plan.h"

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
                      name == RunFolder::kEvaluations || name == RunFolder::kLog;
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

/// Trains a run until its end or a stop signal, and writes the output of `train` to its log.
/// Returns whether the training has ended.
bool TrainLogged(const SeedRun& run) {
  const AppendFile log(run.log());
  const RedirectedOutput redirected(log.descriptor());
  try {
    return TrainAndShow(*MakeOrResume(run));
  } catch (const std::exception& error) {
    SayError(Printable(error.what()));
    throw;
  }
}

/// Worker that trains the unfinished runs of a plan one after the other. Any number of workers on
/// this host and others can do so at the same time: each claims a run before it works on it.
///
/// Resumes a run that another worker left from its checkpoint. If a run fails, writes the reason
/// next to it; no worker tries that run again until the study is started again.
class Worker {
 public:
  explicit Worker(const StudyPlan& plan) : plan_(plan) {}

  /// Ends when no run is left to claim, or at a stop signal. Prints a line and returns the exit
  /// code. Throws Failure if several runs in a row fail here, or if nothing can be written.
  int Run() {
    std::vector<SeedRun> runs = RunsOf(plan_);
    // Repeat while a round trains a run, because another worker may have left a run meanwhile.
    bool tried = true;
    while (tried && !stopped_) {
      tried = false;
      claimed_by_others_ = 0;
      for (SeedRun& run : runs) {
        if (StopSignal() != 0) stopped_ = true;
        if (stopped_) break;
        if (Try(run)) tried = true;
      }
    }
    std::string counts = fmt::format("finished {}, {} failed", done_, failed_);
    if (claimed_by_others_ > 0) {
      counts += fmt::format(", {} claimed by other workers", claimed_by_others_);
    }
    if (stopped_) counts += ", stopped";
    Say("{}: this worker {}\n", Printable(plan_.folder.string()), counts);
    if (stopped_) return kTryAgain;
    return failed_ > 0 ? 1 : 0;
  }

 private:
  /// Claims and trains a run unless it has ended; returns whether it did so.
  bool Try(SeedRun& run) {
    if (!run.finished && Exists(run.done())) run.Refresh();
    const bool ended = run.finished || run.HasFailed();
    if (ended && !Exists(run.claim())) return false;
    std::optional<FileLock> claim;  // removes the file of a killed worker, too
    try {
      claim.emplace(run.claim());
      if (ended) return false;
      if (!claim->held()) {
        ++claimed_by_others_;
        return false;
      }
      run.Read();
      // Another worker has ended it meanwhile.
      if (run.finished || run.HasFailed()) return false;
      Train(run);
    } catch (const FolderBusy&) {  // a process without a claim, such as `train --resume`
      ++claimed_by_others_;
      return false;
    } catch (const NoLocks&) {  // no fault of the run
      throw;
    } catch (const std::exception& error) {
      CountFailure(run, error);
    }
    return true;
  }

  /// Writes the reason of a run's failure. Throws Failure if that fails, or after several failures
  /// in a row, because a broken host must not fail all other runs.
  void CountFailure(const SeedRun& run, const std::exception& error) {
    constexpr int kMostInARow = 3;
    try {
      run.WriteFailed(error.what());
    } catch (const Error&) {
      throw Failure(Concat(run.name, ": ", error.what()));
    }
    ++failed_;
    if (++failed_in_a_row_ < kMostInARow) return;
    throw Failure(Concat(kMostInARow, " runs in a row failed on this worker; last ", run.name, ": ",
                         error.what()));
  }

  void Train(const SeedRun& run) {
    if (!run.AtEnd() && !TrainLogged(run)) {
      stopped_ = true;
      return;
    }
    Finish(run, plan_.keep);
    ++done_;
    failed_in_a_row_ = 0;
  }

  const StudyPlan& plan_;
  int64_t done_ = 0, failed_ = 0;  // number of runs
  int64_t claimed_by_others_ = 0;  // runs that other workers train
  int failed_in_a_row_ = 0;
  bool stopped_ = false;
};

}  // namespace

int WorkOnStudy(const fs::path& folder) {
  InstallSignalHandlers(kStoppingTraining);
  const StudyPlan plan = ReadPlan(folder);
  return Worker(plan).Run();
}

int PrintStudyStatus(const fs::path& folder, bool as_json) {
  const char* const states[] = {"done", "solved", "running", "failed", "stopped", "waiting"};
  const StudyPlan plan = ReadPlan(folder);
  std::map<const Variant*, std::map<std::string_view, int64_t>> counts;  // of runs, by state
  std::vector<std::string> lines;
  for (SeedRun& run : RunsOf(plan)) {
    auto& count = counts[run.variant];
    run.Refresh();
    if (run.finished) {
      ++count["done"];
      if (run.state->solved) ++count["solved"];
    } else if (FileLock::IsHeld(run.claim())) {
      ++count["running"];
      lines.push_back(fmt::format("  {:<20} {:>11} steps  claimed by {}", run.name,
                                  FormatCount(run.Steps()),
                                  Printable(Trim(ReadEnd(run.claim(), 1024)))));
    } else if (!run.problem.empty()) {
      ++count["failed"];
      lines.push_back(fmt::format("  {:<20} failed: {}", run.name, Printable(run.problem)));
    } else {
      ++count[run.state ? "stopped" : "waiting"];
    }
  }
  if (as_json) {
    nlohmann::ordered_json j{{"study", folder.string()}};
    for (const Variant& variant : plan.variants) {
      auto& row = j["variants"].emplace_back();
      row["variant"] = variant.name;
      for (const char* state : states) row[state] = counts[&variant][state];
    }
    Say("{}\n", PrintableJson(j));
    return 0;
  }
  Say("{}\n", Printable(folder.string()));
  Say("  {:<20} {:>8}\n", "", fmt::join(states, " "));
  for (const Variant& variant : plan.variants) {
    Say("  {:<20}", variant.name);
    for (const char* state : states) Say(" {:>8}", counts[&variant][state]);
    Say("\n");
  }
  if (!lines.empty()) Say("\n");
  for (const std::string& line : lines) Say("{}\n", line);
  return 0;
}

}  // namespace upswing
