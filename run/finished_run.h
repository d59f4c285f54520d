#pragma once

#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>

#include "io/run_conditions.h"
#include "rl/trainer.h"

namespace upswing {

/// What a finished run of many leaves in a file of its own, seedN.done, by which other processes
/// know that it is done.
struct FinishedRun {
  TrainState state{0, 0};  // at its end; the running episodes are not in the file
  std::string settings;    // SettingsMark of what it was trained with
  int64_t planned_steps = 0;
  bool stop_when_solved = false;
  std::string version;
  RunConditions conditions;
  std::string evaluations;  // evals.csv

  /// Writes it to a file.
  void Write(const std::filesystem::path& path) const;
  /// Reads it; nothing if there is no such file. Throws BadInput if it is broken.
  static std::optional<FinishedRun> Read(const std::filesystem::path& path);
};

/// Where a run stands by its checkpoint; nothing if there is no run. Throws BadInput.
std::optional<TrainState> ReadTrainState(const std::filesystem::path& run, const EnvSpec& spec);

}  // namespace upswing
