#pragma once

#include <functional>

#include "runs/training_run.h"

namespace upswing {

/// Trains a run until its end or a stop signal, and prints its progress: a description, a progress
/// line, a line for each evaluation, a summary. Calls `check`, which may throw, after each step.
/// Returns whether the training has ended.
bool TrainAndShow(
    TrainingRun& run, const std::function<void()>& check = [] {});

}  // namespace upswing
