#include "run/training_run.h"

#include <algorithm>
#include <utility>

#include "core/error.h"
#include "core/text.h"
#include "io/file.h"
#include "io/machine.h"
#include "io/tensor_file.h"
#include "run/config_files.h"
#include "run/run_log.h"
#include "run/run_rows.h"
#include "run/this_host.h"

namespace upswing {
namespace {

namespace fs = std::filesystem;

/// A folder under runs/ that is not there yet.
fs::path FreeRunFolder(const Config& config) {
  const std::string base = Concat("runs/", config.agent, "-seed", config.train.seed);
  fs::path path = base;
  for (int i = 2; fs::exists(path); ++i) path = Concat(base, "-", i);
  return path;
}

}  // namespace

bool StepsGiven(const std::vector<FlagValue>& flags) {
  return std::ranges::any_of(flags, [](const FlagValue& flag) { return flag.name == "steps"; });
}

std::unique_ptr<TrainingRun> TrainingRun::Make(const fs::path& out, Config config) {
  NameModelCopy(config);
  std::unique_ptr<TrainingRun> run(new TrainingRun(out.empty() ? FreeRunFolder(config) : out));
  const int threads = ResolveThreads(config.train.threads);
  run->training_ = std::make_unique<Training>(std::move(config), ThisHost(threads),
                                              std::vector<TrainObserver*>{run.get()});
  const Config& made = run->training_->config();
  std::vector<std::pair<std::string, std::string>> files{
      {RunFolder::kConfig, ConfigToml(made, false)}};
  if (!made.mjcf.empty()) files.emplace_back(RunFolder::kModel, made.mjcf);
  RunFolder::Create(run->path_, files, run->training_->Checkpoint());
  run->lock_.emplace(run->path_);
  run->Open();
  return run;
}

std::unique_ptr<TrainingRun> TrainingRun::Resume(const fs::path& path,
                                                 const std::vector<FlagValue>& flags) {
  if (!fs::exists(path / RunFolder::kConfig)) {
    throw BadInput(
        Concat("--resume ", path.string(), ": expected a run folder with a config.toml"));
  }
  std::unique_ptr<TrainingRun> run(new TrainingRun(path));
  run->lock_.emplace(path);  // before anything of it is read
  Config config = ReadRunConfig(path, flags);
  NameModelCopy(config);
  const int64_t steps = config.train.steps;
  const int threads = ResolveThreads(config.train.threads);
  run->training_ = std::make_unique<Training>(std::move(config), ThisHost(threads),
                                              std::vector<TrainObserver*>{run.get()});
  run->Open();
  const int64_t done = run->training_->state().steps;
  if (StepsGiven(flags) && steps < done) {
    throw BadInput(Concat("--steps: the run is at step ", done,
                          " already; expected at least that in all, got ", steps));
  }
  WriteFileAtomically(path / RunFolder::kConfig, ConfigToml(run->training_->config(), false));
  return run;
}

void TrainingRun::Open() {
  const Tensors checkpoint = LoadTensors(RunFolder::CheckpointPath(path_));
  training_->Load(checkpoint);
  checkpoint_at_ = training_->state().steps;
  folder_.emplace(path_, checkpoint);
}

bool TrainingRun::Train(Driver& driver) {
  view_ = &driver;
  const WorkClock clock;
  const TrainState& s = training_->state();
  folder_->Log(BeginLine(s.steps > 0, s.steps, training_->threads()));
  bool finished = false;
  try {
    finished = Loop(driver);
  } catch (const Error& error) {
    const Error failure = Failure(Concat("training stopped at step ", s.steps, ": ", error.what(),
                                         "; the checkpoint of step ", checkpoint_at_,
                                         " is kept in ", path_.string()));
    LogIfPossible(failure.what());
    throw failure;
  }
  folder_->Log(EndLine(finished, s.steps, training_->threads(), clock));
  return finished;
}

bool TrainingRun::Loop(Driver& driver) {
  const int64_t every = training_->config().train.checkpoint_every;
  while (training_->Step()) {
    const TrainRequest request = driver.AfterStep(training_->state());
    if (training_->trainer().IsDue(every) || request != TrainRequest::kGoOn) SaveCheckpoint();
    if (request == TrainRequest::kStop) return training_->trainer().finished();
  }
  if (checkpoint_at_ != training_->state().steps) SaveCheckpoint();
  return true;
}

void TrainingRun::SaveCheckpoint() {
  Tensors checkpoint = training_->Checkpoint();
  folder_->SaveCheckpoint(checkpoint);
  checkpoint_at_ = training_->state().steps;
}

void TrainingRun::LogIfPossible(const std::string& line) {
  try {
    folder_->Log(line);
  } catch (const Error&) {  // NOLINT(bugprone-empty-catch): the disk may be full, and the user
  }                         // sees the line anyway
}

void TrainingRun::OnEpisode(const TrainState& s, const FinishedEpisode& episode) {
  folder_->LogEpisode(EpisodeRow(s, episode, training_->spec()));
  view_->OnEpisode(s, episode);
}

void TrainingRun::OnMetrics(const TrainState& s, const Metrics& metrics) {
  folder_->LogMetrics(MetricsRow(s, metrics));
  view_->OnMetrics(s, metrics);
}

void TrainingRun::OnEvaluation(const TrainState& s, const Evaluation& e) {
  folder_->LogEvaluation(EvaluationRow(s, e));
  folder_->Log(Concat("step ", s.steps, ": ", e.successes, " of ", e.episodes,
                      " episodes succeed, mean return ", FormatNumber(e.reward_sum.mean)));
  view_->OnEvaluation(s, e);
}

void TrainingRun::OnBest(const TrainState& s, const Policy& policy) {
  SaveTensors(policy.ToTensors(), path_ / RunFolder::kPolicy);
  view_->OnBest(s, policy);
}

}  // namespace upswing
