#pragma once

#include <cstdint>
#include <string>

/// The clock of the control loop, and its priority over other programs.
namespace upswing::machine {

/// Nanoseconds of a clock that never goes back, and that goes on while the computer sleeps.
int64_t MonotonicNanoseconds();
/// Sleeps until this clock shows `nanoseconds`.
void SleepUntil(int64_t nanoseconds);

/// Locks the program's memory and gives this thread a real-time priority. Returns the missing
/// permissions in one line; empty: none.
std::string EnterRealTime();

}  // namespace upswing::machine
