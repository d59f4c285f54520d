#pragma once

#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>

#include "rl/trainer.h"
#include "run/run_log.h"

namespace upswing {

/// How a training stands or ended, in few numbers, and what its times depend on. A finished run of
/// many leaves it in a file of its own, seedN.done, by which other processes know that it is done.
struct RunResult {
  int64_t steps = 0, episodes = 0;
  double seconds = 0;  // of training, evaluations excluded
  bool solved = false;
  int64_t solved_step = 0;
  double solved_seconds = 0;
  int64_t best_step = 0;  // 0: no evaluation yet
  double best_success_rate = 0, best_return = 0;
  // Only of a finished run:
  std::string settings;  // SettingsMark of what it was trained with
  int64_t planned_steps = 0;
  bool stop_when_solved = false;
  std::string version;
  RunConditions conditions;
  std::string evaluations;  // evals.csv

  /// Whether a training with these settings ends here.
  bool Finished(const TrainConfig& config) const;
};

/// What a training's state says.
RunResult ResultOf(const TrainState& state);

/// The same of a run's checkpoint; nothing if there is no run. Throws BadInput.
std::optional<RunResult> ReadCheckpointResult(const std::filesystem::path& run,
                                              const EnvSpec& spec);

/// Writes and reads the file of a finished run. Reading gives nothing if there is none and throws
/// BadInput if it is broken.
void WriteDone(const std::filesystem::path& path, const RunResult& result);
std::optional<RunResult> ReadDone(const std::filesystem::path& path);

}  // namespace upswing
