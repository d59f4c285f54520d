#pragma once

#include <array>
#include <filesystem>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "base/tensors.h"
#include "os/file.h"
#include "os/lock.h"
#include "rl/train/trainer.h"

namespace upswing {

/// A row of a table: column names and values in order. The first column is the step.
using Row = std::vector<std::pair<std::string, double>>;

// Rows of a run's tables (docs/reference/run-folder.md).

/// Row of episodes.csv for a training episode that has ended.
Row EpisodeRow(const TrainState& s, const FinishedEpisode& episode, const EnvSpec& spec);

/// Row of metrics.csv: the agent's metrics and the training's progress.
Row MetricsRow(const TrainState& s, const Metrics& metrics);

/// Row of evals.csv for an evaluation.
Row EvaluationCells(const TrainState& s, const Evaluation& e);

/// A run on disk:
///   config.toml             every setting; `train --config` repeats the run
///   metrics.csv             a row per log interval
///   episodes.csv            a row per training episode
///   evals.csv               a row per evaluation
///   events.out.tfevents.*   the rows of the three tables for TensorBoard
///   checkpoint.safetensors  the whole state of the training
///   policy.safetensors      the best policy at evaluation
///   log.txt                 events with date and time
/// The checkpoint contains the sizes of the tables. Opening a run cuts the tables to these sizes,
/// so that rows written after the checkpoint do not appear twice.
class RunFolder {
 public:
  // Names of the files.
  static constexpr const char* kConfig = "config.toml";
  static constexpr const char* kMetrics = "metrics.csv";
  static constexpr const char* kEpisodes = "episodes.csv";
  static constexpr const char* kEvaluations = "evals.csv";
  static constexpr const char* kCheckpoint = "checkpoint.safetensors";
  static constexpr const char* kPolicy = "policy.safetensors";
  static constexpr const char* kLog = "log.txt";

  /// Makes the folder with the text of config.toml and the first checkpoint. Adds the tables' sizes
  /// to the checkpoint, so that the folder can be opened with it.
  ///
  /// Makes missing parent folders, as mkdir -p does. The folder appears under its name complete and
  /// locked, or not at all (see Making). Throws BadInput if something is already there, and
  /// NoLocks. Otherwise throws as PathError does.
  static FolderLock Create(const std::filesystem::path& path, const std::string& config,
                           Tensors& checkpoint);

  /// The files that a run has in this folder; none if it is another folder.
  static std::vector<std::filesystem::path> Files(const std::filesystem::path& folder);

  /// Opens a run after its checkpoint has been loaded. The caller holds the run's FolderLock.
  /// Throws BadInput and changes nothing if a table is shorter than its size in the checkpoint. The
  /// same holds if a link shares it with another folder (see AppendFile).
  RunFolder(std::filesystem::path path, const Tensors& checkpoint);
  /// Writes the rows that are not in the files yet, even after a failed training.
  ~RunFolder();
  RunFolder(const RunFolder&) = delete;
  RunFolder& operator=(const RunFolder&) = delete;

  const std::filesystem::path& path() const { return path_; }

  /// Adds rows to the tables. Episodes end thousands of times a second. Their rows are written with
  /// the next row of metrics or checkpoint, or when many are waiting.
  void LogMetrics(const Row& row);
  void LogEpisode(const Row& row);
  void LogEvaluation(const Row& row);
  /// Adds a line with date and time to log.txt.
  void Log(std::string_view line);

  /// Adds the tables' sizes to a checkpoint and writes it in place of the previous one.
  void SaveCheckpoint(Tensors& checkpoint);

 private:
  struct Table {
    std::string tag;  // prefix of its columns in TensorBoard
    AppendFile file;
    std::string pending;  // rows that are not in the file yet
    void Flush();
  };
  /// Appends a row. All rows of a table have the same columns.
  void AppendRow(Table& table, const Row& row);

  /// The files whose sizes are in the checkpoint.
  std::array<AppendFile*, 4> Growing() {
    return {&metrics_.file, &episodes_.file, &evals_.file, &events_};
  }

  std::filesystem::path path_;
  Table metrics_, episodes_, evals_;
  AppendFile events_;
  AppendFile log_;
};

}  // namespace upswing
