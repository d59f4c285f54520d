#pragma once

#include <string_view>

#include "os/signals.h"
#include "runs/training_run.h"

namespace upswing {

/// Terminal message at the first signal to stop a training.
inline constexpr std::string_view kStoppingTraining =
    "\nstopping: a checkpoint is written; once more ends at once\n";

/// The request since the last call; kCheckpoint is returned once for each request.
inline TrainRequest PollSignals() {
  if (StopSignal() != 0) return TrainRequest::kStop;
  return TakeCheckpointRequest() ? TrainRequest::kCheckpoint : TrainRequest::kGoOn;
}

}  // namespace upswing
