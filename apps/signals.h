#pragma once

#include <string_view>

#include "run/training_run.h"

namespace upswing {

// Signals that long work listens to: the handler only notes them, the work asks from time to time.

/// From now on SIGUSR1 is noted and SIGUSR2 ignored: neither ends the program. For the first line
/// of main(), as they may come at any moment.
void ListenToSignals();

/// What a terminal shows at the first signal to stop a training.
inline constexpr std::string_view kStoppingTraining =
    "\nstopping: a checkpoint is written; once more ends at once\n";

/// From now on SIGINT and SIGTERM are noted, each once: a second one ends the program at once. To
/// be called before work that has to end in order. Where standard error is a terminal it then shows
/// `notice`, which must outlive the program's handlers (a literal); empty: nothing.
void InstallSignalHandlers(std::string_view notice);

/// The same for SIGUSR1 and SIGUSR2, with which clusters announce the end of a job's time.
void StopAtUserSignals();

/// What has been requested; kCheckpoint is returned once for each request.
TrainRequest PollSignals();

/// SIGINT or SIGTERM, whichever came; 0 if none did.
int StopSignal();

}  // namespace upswing
