#pragma once

#include <string_view>

/// Signals for long work. Handlers only record a signal; the work polls for it.
namespace upswing {

/// Number of the signal by which ChildProcess::Signal asks for a checkpoint.
extern const int kCheckpointSignal;

/// Starts recording SIGUSR1 and ignoring SIGUSR2, so that neither ends the program. On Windows,
/// starts listening to ChildProcess::Signal of the process that started this one. Call this in
/// the first line of main(), because they may arrive at any moment.
void ListenToSignals();

/// Starts recording SIGINT (Ctrl-C) and SIGTERM (on Windows also a console that closes). The second
/// signal of a kind ends the program at once. Call this before work that has to end in order. If
/// standard error is a terminal, the handler prints `notice` (a literal, because it must outlive
/// the handlers); empty: prints nothing.
void InstallSignalHandlers(std::string_view notice);

/// Like InstallSignalHandlers, for a program that drives motors. Records every signal that would
/// end or pause it, so that it can brake. Before a second SIGINT, SIGTERM or SIGQUIT or a crash
/// ends the program, the handler calls `switch_off`, which must be safe in a signal handler.
void GuardMotors(void (*switch_off)());

/// Whether a checkpoint was asked for since the last call.
bool TakeCheckpointRequest();

/// The received stop signal, such as SIGINT or SIGTERM; 0 if there is none.
int StopSignal();

}  // namespace upswing
