#pragma once

#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

namespace upswing {

/// An evaluation during a training: a row of evals.csv.
struct EvaluationRow {
  int64_t step;         // control steps over all environments
  double seconds;       // of training so far, evaluations excluded
  double success_rate;  // share of the episodes
  double mean_return;
};

/// What a comparison needs to know of a run's settings.
struct RunPlan {
  int64_t seed, steps;       // steps: the budget, at most so many
  int64_t envs, eval_every;  // steps of one lock-step, and from one evaluation to the next
  bool stop_when_solved;
};

/// A training as its folder tells it.
struct RunRecord {
  std::filesystem::path path;
  RunPlan plan;
  std::vector<EvaluationRow> evaluations;  // in the order of their steps
};

/// Reads evals.csv of a run folder; a file that is not there yet is an empty table. Throws BadInput
/// with file and line, also for steps or seconds that fall. Where a killed run left half a line at
/// the end, that is an error too, unless `may_be_cut`: then it is left out.
std::vector<EvaluationRow> ReadEvaluations(const std::filesystem::path& run, bool may_be_cut);

/// The same of the table's text; `where` is its path.
std::vector<EvaluationRow> ParseEvaluations(std::string text, const std::string& where,
                                            bool may_be_cut);

/// Where a run has solved its task: index of the first of the first two evaluations in a row whose
/// episodes all succeed. An evaluation out of turn, at the end, does not count. Nothing if it has
/// not.
std::optional<size_t> SolvedAt(const RunRecord& run);

/// Whether it has come to its end: the budget is used up, or it was to stop once solved and is.
bool Finished(const RunRecord& run);

}  // namespace upswing
