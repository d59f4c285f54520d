#pragma once

#include "runs/training_run.h"

namespace upswing {

/// Trains a run until its end or a stop signal, and prints its progress: a description, a progress
/// line, a line for each evaluation, a summary. Returns whether the training has ended.
bool TrainAndShow(TrainingRun& run);

}  // namespace upswing
