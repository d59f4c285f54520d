#pragma once

#include <cstdint>

/// Control steps are counted over all environments: each step of N environments counts as N.
namespace upswing {

/// More control steps than any training makes.
inline constexpr int64_t kMostSteps = 2'000'000'000'000;

/// Whether an event that is due at each multiple of `every` (at least 1) falls in the step from
/// `before` to `now`.
inline bool IsDue(int64_t before, int64_t now, int64_t every) {
  return now / every != before / every;
}

}  // namespace upswing
