#pragma once

#include <string>
#include <vector>

#include "judge/eval_report.h"

/// Bounds on the return and swing-up time of the episodes of `eval`: the best episodes that a
/// search finds, to compare policies with.
namespace upswing {

/// The best episode found for each start, judged in an engine: one for the return, one for the
/// swing-up time.
struct BestEpisodes {
  std::vector<EvaluationEpisode> of_return, of_time;  // (N)
};

struct BoundsConfig {
  TrialArguments trial;  // the plant, the engine and the seed of the starts
  int64_t episodes = 100, torques = 9, guesses = 24;

  /// Declares the numeric settings in `options`: name, range, help.
  void Describe(Options& options);
};

/// The best episodes found with any torque within the limit, and with a table of torques. An
/// episode with the table also counts for `any` if it is better. None is proved to be the best.
struct EpisodeBounds {
  EvaluationRule rule;
  std::vector<std::vector<double>> starts;  // (N, S)
  BestEpisodes any, table;
};

/// Searches (control/best_episode.h), then judges the found episodes in the trial's engine.
/// `progress` counts guesses and episodes, which take about equally long. Throws BadInput, and as
/// BestEpisodeSearch does.
EpisodeBounds FindBounds(const BoundsConfig& config, ThreadPool& pool, const Progress& progress);

/// Throws BadInput unless the policy's plant is the plant that the search uses.
void CheckComparable(const LoadedPolicy& loaded, const BoundsConfig& config);

/// The bounds as CSV, one row for each episode.
std::string BoundsCsv(const EpisodeBounds& bounds);

}  // namespace upswing
