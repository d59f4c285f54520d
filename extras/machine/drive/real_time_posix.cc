#include <sched.h>
#include <sys/mman.h>
#include <sys/prctl.h>

#include <cerrno>
#include <cstring>
#include <ctime>

#include "base/text.h"
#include "extras/machine/drive/real_time.h"

namespace upswing::machine {
namespace {

constexpr int64_t kSecond = 1'000'000'000;    // ns
constexpr clockid_t kClock = CLOCK_BOOTTIME;  // goes on while the computer sleeps

}  // namespace

int64_t MonotonicNanoseconds() {
  timespec now{};
  clock_gettime(kClock, &now);
  return now.tv_sec * kSecond + now.tv_nsec;
}

void SleepUntil(int64_t nanoseconds) {
  const timespec moment{nanoseconds / kSecond, nanoseconds % kSecond};
  while (clock_nanosleep(kClock, TIMER_ABSTIME, &moment, nullptr) == EINTR) {
  }
}

std::string EnterRealTime() {
  std::string problems;
  const auto add = [&](const char* what) {
    problems += Concat(problems.empty() ? "" : ", ", what, " (", std::strerror(errno), ")");
  };
  // Only memory that exists: later allocations, of other threads, must not fail at a limit.
  if (mlockall(MCL_CURRENT) != 0) add("locked memory");
  prctl(PR_SET_TIMERSLACK, 1UL);  // without a real-time priority, timers may be 50 µs late
  sched_param priority{};
  priority.sched_priority = 50;
  if (sched_setscheduler(0, SCHED_FIFO, &priority) != 0) add("real-time priority");
  return problems;
}

}  // namespace upswing::machine
