#pragma once

#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>

#include "study/study_plan.h"

namespace upswing {

/// Throws Failure unless jobs can be submitted on this machine.
void CheckSlurm();

/// Throws BadInput unless these are options of sbatch that a script can have, as typed on one line.
void CheckSlurmOptions(const std::string& options);

/// The script of a job array of so many tasks, each a worker (`study --work`) of the study in a
/// folder. `options` are sbatch's; they beat the script's own. Throws BadInput if the folder cannot
/// stand in a script.
std::string SlurmScript(const StudyPlan& plan, const std::string& options, int64_t tasks);

/// A job array in Slurm's queue.
class SlurmArray {
 public:
  /// Writes FOLDER/slurm.sh and queues it. Throws Failure, with what sbatch says.
  static SlurmArray Submit(const std::filesystem::path& folder, const std::string& script);

  /// The array that was last submitted in this folder; nothing if there is none.
  static std::optional<SlurmArray> LastOf(const std::filesystem::path& folder);

  /// Such as 1234.
  const std::string& number() const { return number_; }

  /// How many of its tasks wait or run; nothing if Slurm does not say (it may not answer now).
  std::optional<int64_t> TasksLeft() const;

  /// The command that cancels it.
  std::string CancelCommand() const;

 private:
  SlurmArray(std::string number, std::string cluster)
      : number_(std::move(number)), cluster_(std::move(cluster)) {}
  static std::optional<SlurmArray> Parse(std::string_view text);

  std::string number_;
  std::string cluster_;  // where sbatch named one of several
};

/// Where the tasks' output goes, and the number of the last array.
std::filesystem::path SlurmFolder(const std::filesystem::path& study);

}  // namespace upswing
