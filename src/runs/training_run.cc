#include "runs/training_run.h"

#include <algorithm>
#include <ctime>
#include <utility>

#include "base/error.h"
#include "base/stopwatch.h"
#include "base/text.h"
#include "os/file.h"
#include "os/host.h"
#include "runs/config_files.h"
#include "runs/run_conditions.h"
#include "runs/tensor_file.h"
#include "runs/this_host.h"

namespace upswing {
namespace {

namespace fs = std::filesystem;

/// Wall time and processor time of this process since the construction.
class WorkClock : public Stopwatch {
 public:
  /// Share of the time in which `threads` threads worked, about 0 to 1.
  double busy(int threads) const {
    const double at_work = static_cast<double>(std::clock() - cpu_begin_) / CLOCKS_PER_SEC;
    return at_work / std::max(1e-9, seconds() * threads);
  }

 private:
  std::clock_t cpu_begin_ = std::clock();
};

}  // namespace

bool StepsGiven(const std::vector<FlagValue>& flags) {
  return std::ranges::any_of(flags, [](const FlagValue& flag) { return flag.name == "steps"; });
}

TrainingRun::TrainingRun(fs::path path, const Config& config, ForeignMaker make_foreign)
    : path_(std::move(path)),
      training_(config, ThisHost(ResolveThreads(config.train.threads), std::move(make_foreign))) {
  training_.AddObserver(*this);
}

std::unique_ptr<TrainingRun> TrainingRun::Make(const fs::path& out, Config config,
                                               ForeignMaker make_foreign) {
  const std::shared_ptr<const Policy> start = StartPolicy(config);
  const fs::path usual = Concat("runs/", config.agent, "-seed", config.train.seed);
  const fs::path path = out.empty() ? FreePath(usual) : out;
  std::unique_ptr<TrainingRun> run(new TrainingRun(path, config, std::move(make_foreign)));
  if (start)
    run->training_.StartFrom(*start, Concat("--start-policy ", PathOfStart(config.start_policy)));
  Tensors checkpoint = run->training_.Checkpoint();
  run->lock_.emplace(
      RunFolder::Create(path, ConfigToml(run->training_.config(), false), checkpoint));
  run->folder_.emplace(path, checkpoint);
  return run;
}

std::unique_ptr<TrainingRun> TrainingRun::Resume(const fs::path& path,
                                                 const std::vector<FlagValue>& flags,
                                                 ForeignMaker make_foreign) {
  if (!fs::exists(path / RunFolder::kConfig)) {
    throw BadInput(
        Concat("--resume ", path.string(), ": expected a run folder with a config.toml"));
  }
  FolderLock lock(path);  // taken before the run is read
  std::unique_ptr<TrainingRun> run(
      new TrainingRun(path, ReadRunConfig(path, flags), std::move(make_foreign)));
  run->lock_.emplace(std::move(lock));
  Training& training = run->training_;
  const Tensors checkpoint = LoadTensors(path / RunFolder::kCheckpoint);
  training.Load(checkpoint);
  run->checkpoint_at_ = training.state().steps;
  run->folder_.emplace(path, checkpoint);
  const int64_t steps = training.config().train.steps;
  if (StepsGiven(flags) && steps < run->checkpoint_at_) {
    throw BadInput(Concat("--steps: expected at least ", run->checkpoint_at_,
                          ", the steps that the run has already, got ", steps));
  }
  WriteFileAtomically(path / RunFolder::kConfig, ConfigToml(training.config(), false));
  return run;
}

bool TrainingRun::Train(TrainObserver& view, const std::function<TrainRequest()>& poll) {
  training_.AddObserver(view);
  const WorkClock clock;
  const TrainState& s = training_.state();
  folder_->Log(Concat(s.steps > 0 ? "resumed" : "started", " at step ", s.steps, " ",
                      BeginFacts(training_.threads(), UPSWING_VERSION)));
  bool finished = false;
  try {
    finished = Loop(poll);
  } catch (const Error& error) {
    training_.FinishEvaluationQuietly();
    const Error failure = Failure(Concat("training stopped at step ", s.steps, ": ", error.what(),
                                         "; the checkpoint of step ", checkpoint_at_,
                                         " is kept in ", path_.string()));
    LogIfPossible(failure.what());
    throw failure;
  } catch (...) {  // from an environment in Python
    training_.FinishEvaluationQuietly();
    LogIfPossible(Concat("stopped by an exception at step ", s.steps));
    throw;
  }
  folder_->Log(Concat(finished ? "finished" : "stopped", " at step ", s.steps, " ",
                      EndFacts(clock.seconds(), clock.busy(training_.threads()))));
  return finished;
}

bool TrainingRun::Loop(const std::function<TrainRequest()>& poll) {
  const int64_t every = training_.config().train.checkpoint_every;
  bool is_due = false;
  while (training_.Step()) {
    const TrainRequest request = poll();
    is_due |= training_.trainer().IsDue(every);
    // A checkpoint waits for an evaluation in the background, so that both can be due together.
    const bool is_time = is_due && !training_.trainer().is_evaluating();
    if (is_time || request != TrainRequest::kGoOn) {
      SaveCheckpoint();
      is_due = false;
    }
    if (request == TrainRequest::kStop) return training_.trainer().finished();
  }
  if (checkpoint_at_ != training_.state().steps) SaveCheckpoint();
  return true;
}

void TrainingRun::SaveCheckpoint() {
  Tensors checkpoint = training_.Checkpoint();
  folder_->SaveCheckpoint(checkpoint);
  checkpoint_at_ = training_.state().steps;
}

void TrainingRun::LogIfPossible(const std::string& line) {
  try {
    folder_->Log(line);
  } catch (const Error&) {  // NOLINT(bugprone-empty-catch): the disk may be full, and the user
  }                         // sees the line anyway
}

void TrainingRun::OnEpisode(const TrainState& s, const FinishedEpisode& episode) {
  folder_->LogEpisode(EpisodeRow(s, episode, training_.spec()));
}

void TrainingRun::OnMetrics(const TrainState& s, const Metrics& metrics) {
  folder_->LogMetrics(MetricsRow(s, metrics));
}

void TrainingRun::OnEvaluation(const TrainState& s, const Evaluation& e) {
  folder_->LogEvaluation(EvaluationCells(s, e));
  folder_->Log(Concat("step ", s.steps, ": ", e.successes, " of ", e.episodes,
                      " episodes succeed, mean return ", FormatNumber(e.reward_sum.mean),
                      e.diverged > 0 ? Concat(", the simulation diverged in ", e.diverged) : ""));
}

void TrainingRun::OnBest(const TrainState& /*s*/, const Policy& policy) {
  SaveTensors(policy.ToTensors(), path_ / RunFolder::kPolicy);
}

}  // namespace upswing
