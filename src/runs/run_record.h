#pragma once

#include <cstdint>
#include <filesystem>
#include <limits>
#include <optional>
#include <string>
#include <vector>

#include "agents/config.h"
#include "runs/run_conditions.h"

namespace upswing {

/// An evaluation during a training: a row of evals.csv.
struct EvaluationRow {
  int64_t step;         // control steps over all environments
  double seconds;       // training time so far, without evaluations
  double success_rate;  // share of successful episodes
  double mean_return;
  // Means over the episodes, in the task's unit of actions and in that unit per second.
  double rms_torque = 0, torque_variation = 0;
  double upright_variation = kUnknown;  // of the successful episodes, from upright to their end
  double value_ratio = kUnknown;        // see ValueRatio

  static constexpr double kUnknown = std::numeric_limits<double>::infinity();
};

/// A training, read from its folder or from its result file.
struct RunRecord {
  std::filesystem::path path;
  Config config;
  std::string settings;                         // SettingsMark
  std::vector<EvaluationRow> evaluations = {};  // in the order of steps
  RunConditions conditions = {};                // conditions that its times depend on
  std::string variant = {};                     // name within a study; empty outside of a study
};

/// Reads evals.csv of a run folder; a missing file is an empty table. Throws BadInput with file and
/// line, also if steps or seconds decrease.
///
/// A killed run can leave an incomplete last line. It is an error unless `may_be_cut`, which drops
/// it.
std::vector<EvaluationRow> ReadEvaluations(const std::filesystem::path& run, bool may_be_cut);

/// Parses the text of evals.csv; `where` is its path.
std::vector<EvaluationRow> ParseEvaluations(std::string text, const std::string& where,
                                            bool may_be_cut);

/// Index of the evaluation at which a run has solved its task: the first of the first two passed
/// evaluations in a row. An unscheduled final evaluation does not count. Nothing if the run has not
/// solved the task.
std::optional<size_t> SolvedAt(const RunRecord& run);

/// Whether the run has ended: its budget is used up, or it has solved the task and stops then.
bool Finished(const RunRecord& run);

}  // namespace upswing
