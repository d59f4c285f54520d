#pragma once

#include <cstdint>

/// Control steps, counted over all environments: they rise by the number of environments.
namespace upswing {

/// More than any training makes.
inline constexpr int64_t kMostSteps = 2'000'000'000'000;

/// Whether something that is due at each multiple of `every` (at least 1) is due after the step
/// that leads from `before` to `now`.
inline bool IsDue(int64_t before, int64_t now, int64_t every) {
  return now / every != before / every;
}

}  // namespace upswing
