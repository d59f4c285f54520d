#pragma once

#include <filesystem>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "core/tensors.h"
#include "io/event_file.h"
#include "io/file.h"

namespace upswing {

/// A row of a table: column names and values in their order. The first column is the step.
using Row = std::vector<std::pair<std::string, double>>;

/// A run on disk:
///   config.toml             every setting; `train --config` runs it again
///   metrics.csv             a row for each log interval
///   episodes.csv            a row for each training episode
///   evals.csv               a row for each evaluation
///   events.out.tfevents.*   metrics and evaluations for TensorBoard
///   checkpoint.safetensors  the whole state of the training
///   policy.safetensors      the best policy at evaluation
///   log.txt                 events with date and time
///   model.xml               the MJCF, where it is not the built-in model
/// The sizes of the tables are part of the checkpoint; opening a run cuts the tables back to them,
/// so that what a killed run wrote after its checkpoint is not there twice.
class RunFolder {
 public:
  // The files' names.
  static constexpr const char* kConfig = "config.toml";
  static constexpr const char* kMetrics = "metrics.csv";
  static constexpr const char* kEpisodes = "episodes.csv";
  static constexpr const char* kEvaluations = "evals.csv";
  static constexpr const char* kCheckpoint = "checkpoint.safetensors";
  static constexpr const char* kPolicy = "policy.safetensors";
  static constexpr const char* kLog = "log.txt";
  static constexpr const char* kModel = "model.xml";  // where it is not the built-in one

  /// Makes the folder with these files in it (name, text) and the first checkpoint. Missing parent
  /// folders are made, as mkdir -p does; the folder itself appears under its name whole or not at
  /// all (see Making). Adds the tables' sizes to the checkpoint, with which the folder can be
  /// opened. Throws BadInput if something is there already, and as PathError does.
  static void Create(const std::filesystem::path& path,
                     const std::vector<std::pair<std::string, std::string>>& files,
                     Tensors& checkpoint);

  /// Opens a run whose checkpoint has been loaded; the caller holds its FolderLock. Throws
  /// BadInput, with nothing changed, if a table is shorter than its size in the checkpoint, or is
  /// shared with another folder by a link (see AppendFile).
  RunFolder(std::filesystem::path path, const Tensors& checkpoint);
  /// Writes the rows that are not in the files yet; of a training that fails, too.
  ~RunFolder();
  RunFolder(const RunFolder&) = delete;
  RunFolder& operator=(const RunFolder&) = delete;

  const std::filesystem::path& path() const { return path_; }
  static std::filesystem::path CheckpointPath(const std::filesystem::path& run) {
    return run / kCheckpoint;
  }

  /// Rows of the tables. Those of episodes, thousands a second, are in the file with the next row
  /// of metrics or checkpoint, or when there are many.
  void LogMetrics(const Row& row);
  void LogEpisode(const Row& row);
  void LogEvaluation(const Row& row);
  /// A line with date and time in log.txt.
  void Log(std::string_view line);

  /// Adds the tables' sizes to a checkpoint and writes it in place of the last one.
  void SaveCheckpoint(Tensors& checkpoint);

 private:
  struct Table {
    std::string tag;  // prefix of its columns in TensorBoard; empty: not shown there
    AppendFile file;
    std::vector<std::string> columns;  // in the first line; empty: no line yet
    std::string pending;               // rows that are not in the file yet
    void Flush();
  };
  /// Under the columns that the table has, whatever version began it.
  void AppendRow(Table& table, const Row& row);

  std::filesystem::path path_;
  Table metrics_, episodes_, evals_;
  EventFile events_;
  AppendFile log_;
};

}  // namespace upswing
