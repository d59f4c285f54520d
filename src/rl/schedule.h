#pragma once

#include <algorithm>
#include <cmath>
#include <cstdint>

namespace upswing {

/// Value of a setting that moves linearly from `begin` to `end` over the first `length` steps and
/// then stays.
inline double Scheduled(double begin, double end, int64_t steps, int64_t length) {
  return std::lerp(begin, end,
                   std::min(1.0, static_cast<double>(steps) / static_cast<double>(length)));
}

}  // namespace upswing
