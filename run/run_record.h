#pragma once

#include <cstdint>
#include <filesystem>
#include <limits>
#include <optional>
#include <string>
#include <vector>

#include "io/run_conditions.h"
#include "setup/config.h"

namespace upswing {

/// An evaluation during a training: a row of evals.csv.
struct EvaluationRow {
  int64_t step;         // control steps over all environments
  double seconds;       // of training so far, evaluations excluded
  double success_rate;  // share of the episodes
  double mean_return;
  // Means over the episodes, in the task's unit of actions and that a second.
  double rms_torque = 0, torque_variation = 0;
  double upright_variation = kUnknown;  // of the episodes that succeed, from upright to their end
  double value_ratio = kUnknown;        // ValueRatio

  static constexpr double kUnknown = std::numeric_limits<double>::infinity();
};

/// A training, read from its folder or from its result file.
struct RunRecord {
  std::filesystem::path path;
  Config config;
  std::string settings;                         // SettingsMark
  std::vector<EvaluationRow> evaluations = {};  // in the order of their steps
  RunConditions conditions = {};                // what its times depend on
  std::string variant = {};                     // its name within a study, or empty
};

/// Reads evals.csv of a run folder; a file that does not exist yet is an empty table. Throws
/// BadInput with file and line, also if steps or seconds decrease. An incomplete last line, as a
/// killed run leaves it, is an error, too, unless `may_be_cut`: then it is left out.
std::vector<EvaluationRow> ReadEvaluations(const std::filesystem::path& run, bool may_be_cut);

/// Parses the text of evals.csv; `where` is its path.
std::vector<EvaluationRow> ParseEvaluations(std::string text, const std::string& where,
                                            bool may_be_cut);

/// Where a run has solved its task: index of the first of the first two passed evaluations in a
/// row; an unscheduled final evaluation does not count. Nothing if it has not
/// solved it.
std::optional<size_t> SolvedAt(const RunRecord& run);

/// Whether the run has ended: its budget is used up, or it was to stop once solved and is solved.
bool Finished(const RunRecord& run);

}  // namespace upswing
