#pragma once

#include <algorithm>
#include <span>

namespace upswing {

/// Index of the largest number; the first index if several are equal.
inline int ArgMax(std::span<const float> values) {
  return static_cast<int>(std::ranges::max_element(values) - values.begin());
}

}  // namespace upswing
