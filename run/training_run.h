#pragma once

#include <filesystem>
#include <functional>
#include <memory>
#include <optional>
#include <vector>

#include "io/run_folder.h"
#include "setup/training.h"

namespace upswing {

/// What a user may request during a training.
enum class TrainRequest { kGoOn, kCheckpoint, kStop };

/// Whether one of the flags sets the number of steps.
bool StepsGiven(const std::vector<FlagValue>& flags);

/// A training in a run folder, into which it writes tables, log, checkpoints and the best policy.
class TrainingRun : private TrainObserver {
 public:
  /// A new run in the folder `out`, with its first checkpoint; if `out` is empty in
  /// runs/AGENT-seedSEED, or with -2, -3, … where that is taken. Throws BadInput, with nothing
  /// written.
  static std::unique_ptr<TrainingRun> Make(const std::filesystem::path& out, Config config);

  /// The run in a folder, with some settings changed. Throws BadInput, with nothing changed, if
  /// another process works there, if the run is not whole, or if it is another version's.
  static std::unique_ptr<TrainingRun> Resume(const std::filesystem::path& path,
                                             const std::vector<FlagValue>& flags = {});

  const Training& training() const { return training_; }
  const std::filesystem::path& path() const { return path_; }

  /// Trains to the end, or until `poll`, called after each step, requests to stop; then the state
  /// is on disk. The view observes each event after the folder has it, and must outlive the
  /// training. To be called once. Returns whether the training has ended. Throws Failure that names
  /// the step and the last complete checkpoint.
  bool Train(TrainObserver& view, const std::function<TrainRequest()>& poll);

 private:
  TrainingRun(std::filesystem::path path, const Config& config);
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
