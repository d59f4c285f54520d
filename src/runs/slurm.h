#pragma once

#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>

#include "runs/study_plan.h"

namespace upswing {

/// Throws Failure unless jobs can be submitted on this machine.
void CheckSlurm();

/// Throws BadInput unless `options`, as typed on one line, are sbatch options that a script may
/// contain.
void CheckSlurmOptions(const std::string& options);

/// The script of a job array of `tasks` tasks. Each task is a worker (`study --work`) of the study
/// in the plan's folder. `options` are options of sbatch and override the script's own. Throws
/// BadInput if a script cannot contain the folder's name.
std::string SlurmScript(const StudyPlan& plan, const std::string& options, int64_t tasks);

/// A job array in Slurm's queue.
class SlurmArray {
 public:
  /// Writes FOLDER/slurm.sh and submits it. Throws Failure with sbatch's message.
  static SlurmArray Submit(const std::filesystem::path& folder, const std::string& script);

  /// The last array that was submitted in this folder; nothing if there is none.
  static std::optional<SlurmArray> LastOf(const std::filesystem::path& folder);

  /// Job number, such as 1234.
  const std::string& number() const { return number_; }

  /// Number of tasks that wait or run; nothing if Slurm does not answer now.
  std::optional<int64_t> TasksLeft() const;

  /// The command that cancels the array.
  std::string CancelCommand() const;

 private:
  SlurmArray(std::string number, std::string cluster)
      : number_(std::move(number)), cluster_(std::move(cluster)) {}
  static std::optional<SlurmArray> Parse(std::string_view text);

  std::string number_;
  std::string cluster_;  // cluster, if sbatch named one of several
};

/// Folder for the tasks' output and the number of the last array.
std::filesystem::path SlurmFolder(const std::filesystem::path& study);

}  // namespace upswing
