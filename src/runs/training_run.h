#pragma once

#include <filesystem>
#include <functional>
#include <memory>
#include <optional>
#include <vector>

#include "agents/training.h"
#include "runs/run_folder.h"

namespace upswing {

/// A user's request during a training.
enum class TrainRequest { kGoOn, kCheckpoint, kStop };

/// Whether a flag sets the number of steps.
bool StepsGiven(const std::vector<FlagValue>& flags);

/// A training in a run folder. It writes tables, log, checkpoints and the best policy there.
class TrainingRun : private TrainObserver {
 public:
  /// Makes a new run in the folder `out`, with its first checkpoint. If `out` is empty, the folder
  /// is runs/AGENT-seedSEED, or that with -2, -3, … if it exists. Throws BadInput and writes
  /// nothing.
  /// `make_foreign` makes the environments of a foreign task.
  static std::unique_ptr<TrainingRun> Make(const std::filesystem::path& out, Config config,
                                           ForeignMaker make_foreign = {});

  /// Opens the run in a folder and changes some settings. Throws BadInput and changes nothing if
  /// another process works there, or if the run is incomplete or from another version.
  static std::unique_ptr<TrainingRun> Resume(const std::filesystem::path& path,
                                             const std::vector<FlagValue>& flags = {},
                                             ForeignMaker make_foreign = {});

  const Training& training() const { return training_; }
  /// Lets the training wait for each evaluation; see Trainer::WaitForEvaluations.
  void WaitForEvaluations() { training_.WaitForEvaluations(); }
  const std::filesystem::path& path() const { return path_; }

  /// Trains to the end, or until `poll`, which is called after each step, requests a stop. The
  /// state is then on disk. Returns whether the training has ended. Call it once.
  ///
  /// The view observes each event after the folder and must outlive the training. Throws Failure
  /// that names the step and the last complete checkpoint.
  bool Train(TrainObserver& view, const std::function<TrainRequest()>& poll);

 private:
  TrainingRun(std::filesystem::path path, const Config& config, ForeignMaker make_foreign = {});
  /// Trains to the end or a stop.
  bool Loop(const std::function<TrainRequest()>& poll);
  void SaveCheckpoint();
  void LogIfPossible(const std::string& line);

  void OnEpisode(const TrainState& s, const FinishedEpisode& episode) override;
  void OnMetrics(const TrainState& s, const Metrics& metrics) override;
  void OnEvaluation(const TrainState& s, const Evaluation& e) override;
  void OnBest(const TrainState& s, const Policy& policy) override;

  std::filesystem::path path_;
  Training training_;
  std::optional<FolderLock> lock_;
  std::optional<RunFolder> folder_;
  int64_t checkpoint_at_ = 0;  // step of the last checkpoint
};

}  // namespace upswing
