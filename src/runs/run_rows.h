#pragma once

#include "rl/trainer.h"
#include "runs/run_folder.h"

/// Rows of a run's tables (docs/reference/run-folder.md).
namespace upswing {

/// Row of episodes.csv for a training episode that has ended.
Row EpisodeRow(const TrainState& s, const FinishedEpisode& episode, const EnvSpec& spec);

/// Row of metrics.csv: the agent's metrics and the training's progress.
Row MetricsRow(const TrainState& s, const Metrics& metrics);

/// Row of evals.csv for an evaluation.
Row EvaluationCells(const TrainState& s, const Evaluation& e);

}  // namespace upswing
