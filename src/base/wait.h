#pragma once

#include <atomic>
#include <cstdint>

/// Sleeping until another thread changes a number. wait.cc is std::atomic's own way. On Windows,
/// wait_windows.cc is the system's: that of libstdc++ there, by mutex and condition, now and then
/// misses a notification.
namespace upswing {

/// Sleeps until `value` differs from `old`. It may return earlier.
void Wait(const std::atomic<uint32_t>& value, uint32_t old);
/// Wakes one thread, or all threads, that wait for `value`.
void WakeOne(std::atomic<uint32_t>& value);
void WakeAll(std::atomic<uint32_t>& value);

}  // namespace upswing
