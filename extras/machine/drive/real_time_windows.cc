#include <chrono>
#include <thread>

#include "extras/machine/drive/real_time.h"

namespace upswing::machine {
namespace {

using Clock = std::chrono::steady_clock;
using std::chrono::nanoseconds;

}  // namespace

int64_t MonotonicNanoseconds() {
  return std::chrono::duration_cast<nanoseconds>(Clock::now().time_since_epoch()).count();
}

void SleepUntil(int64_t moment) {
  std::this_thread::sleep_until(
      Clock::time_point(std::chrono::duration_cast<Clock::duration>(nanoseconds(moment))));
}

std::string EnterRealTime() { return "real-time priority (Windows has none for this program)"; }

}  // namespace upswing::machine
