#pragma once

#include <string>
#include <vector>

#include "judge/eval_report.h"

/// The best that is found of the episodes of `eval`, and how near policies come to it.
namespace upswing {

/// The best that was found of each episode, judged in an engine: for the return, and for the
/// swing-up time.
struct BestEpisodes {
  std::vector<EvaluationEpisode> of_return, of_time;  // (N)
};

struct BoundsConfig {
  TrialArguments trial;  // the plant, the engine and the seed of the starts
  int64_t episodes = 100, torques = 9, guesses = 24;

  /// Its numbers: name, range, help.
  void Describe(Options& options);
};

/// What was found with any torque within the limit, and with a table of them, whose episodes count
/// for the former where they are better. None of it is proved to be the best.
struct EpisodeBounds {
  EvaluationRule rule;
  std::vector<std::vector<double>> starts;  // (N, S)
  BestEpisodes any, table;
};

/// Searches (control/best_episode.h), then judges what was found in the engine that the trial
/// names. `progress` counts guesses and episodes, which take about as long. Throws BadInput,
/// and as BestEpisodeSearch does.
EpisodeBounds FindBounds(const BoundsConfig& config, ThreadPool& pool, const Progress& progress);

/// Throws BadInput unless the policy is judged on the plant that the search knows.
void CheckComparable(const LoadedPolicy& loaded, const BoundsConfig& config);

/// A row for each episode.
std::string BoundsCsv(const EpisodeBounds& bounds);

}  // namespace upswing
