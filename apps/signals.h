#pragma once

#include "rl/train.h"

namespace upswing {

// Signals that long work listens to: the handler only notes them, the work asks from time to time.

/// From now on SIGUSR1 is noted and SIGUSR2 means nothing: neither ends the program. For the first
/// line of main(), as they may come at any moment.
void ListenToSignals();

/// From now on SIGINT and SIGTERM are noted, each once: a second one ends the program at once. For
/// the moment before something is begun that is to be ended in order.
void InstallSignalHandlers();

/// What has been asked for; kCheckpoint is told once.
TrainRequest PollSignals();

/// SIGINT or SIGTERM, whichever came; 0 if none did.
int StopSignal();

}  // namespace upswing
