#pragma once

#include <algorithm>
#include <cmath>
#include <span>
#include <string>

#include "base/text.h"

namespace upswing {

/// Describes the first number that is not finite: `expected finite numbers, got nan at index 3`. ""
/// if all numbers are finite.
template <typename T>
std::string FindNotFinite(std::span<const T> values) {
  const auto bad = std::ranges::find_if(values, [](T x) { return !std::isfinite(x); });
  if (bad == values.end()) return "";
  return Concat("expected finite numbers, got ", *bad, " at index ", bad - values.begin());
}

}  // namespace upswing
