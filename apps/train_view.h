#pragma once

#include <functional>

#include "run/training_run.h"

namespace upswing {

/// Trains a run to its end or until a signal stops it, and prints what people see of it: what is
/// trained, a progress line, a line for each evaluation, a summary. Calls `check`, which may throw,
/// after each step. Returns whether the training has ended.
bool TrainAndShow(
    TrainingRun& run, const std::function<void()>& check = [] {});

}  // namespace upswing
