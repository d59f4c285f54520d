#pragma once

#include <string_view>

#include "runs/training_run.h"

namespace upswing {

// Signals for long work. Handlers only record a signal; the work polls for it.

/// Starts recording SIGUSR1 and ignoring SIGUSR2, so that neither ends the program. Call this in
/// the first line of main(), because they may arrive at any moment.
void ListenToSignals();

/// Terminal message at the first signal to stop a training.
inline constexpr std::string_view kStoppingTraining =
    "\nstopping: a checkpoint is written; once more ends at once\n";

/// Starts recording SIGINT and SIGTERM. The second signal of a kind ends the program at once. Call
/// this before work that has to end in order. If standard error is a terminal, the handler prints
/// `notice` (a literal, because it must outlive the handlers); empty: prints nothing.
void InstallSignalHandlers(std::string_view notice);

/// Like InstallSignalHandlers, for a program that drives motors. Records every signal that would
/// end or pause it, so that it can brake. Before a second SIGINT, SIGTERM or SIGQUIT or a crash
/// ends the program, the handler calls `switch_off`, which must be safe in a signal handler.
void GuardMotors(void (*switch_off)());

/// The request since the last call; kCheckpoint is returned once for each request.
TrainRequest PollSignals();

/// The received stop signal, such as SIGINT or SIGTERM; 0 if there is none.
int StopSignal();

}  // namespace upswing
