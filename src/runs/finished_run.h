#pragma once

#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <string_view>

#include "rl/train/trainer.h"
#include "runs/run_conditions.h"

namespace upswing {

/// Result file seedN.done of a finished run of a study. Other processes recognise by it that the
/// run is done.
struct FinishedRun {
  TrainState state{0, 0};  // final state, without the running episodes
  std::string settings;    // SettingsMark of the training's settings
  int64_t planned_steps = 0;
  bool stop_when_solved = false;
  std::string version;
  RunConditions conditions;
  std::string evaluations;  // evals.csv

  /// Writes the result to a file.
  void Write(const std::filesystem::path& path) const;
  /// Parses the text of a result file. Throws BadInput.
  static FinishedRun Parse(std::string_view text);
  /// Reads a result file; nothing if it does not exist. Throws BadInput if it is broken.
  static std::optional<FinishedRun> Read(const std::filesystem::path& path);
};

/// Reads the state of a run from its checkpoint; nothing if there is no run. Throws BadInput.
std::optional<TrainState> ReadTrainState(const std::filesystem::path& run, const EnvSpec& spec);

}  // namespace upswing
