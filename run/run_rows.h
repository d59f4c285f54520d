#pragma once

#include "io/run_folder.h"
#include "rl/trainer.h"

/// What is told of a training as it goes on: the rows of a run's tables
/// (docs/reference/run-folder.md).
namespace upswing {

/// Of episodes.csv: a training episode that has ended.
Row EpisodeRow(const TrainState& s, const FinishedEpisode& episode, const EnvSpec& spec);

/// Of metrics.csv: the agent's metrics, and where the training stands.
Row MetricsRow(const TrainState& s, const Metrics& metrics);

/// Of evals.csv: an evaluation.
Row EvaluationCells(const TrainState& s, const Evaluation& e);

}  // namespace upswing
