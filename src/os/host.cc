#include "os/host.h"

#include <algorithm>

namespace upswing {

int ResolveThreads(int64_t wanted) {
  if (wanted > 0) return static_cast<int>(wanted);
  // More threads hardly help, because work is cut into only a few slices, and idle threads cost
  // time.
  constexpr int kMostThreads = 8;
  return std::min(UsableProcessors(), kMostThreads);
}

}  // namespace upswing
