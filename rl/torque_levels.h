#pragma once

#include <cstdint>
#include <vector>

namespace upswing {

/// So many torques, at least 2, evenly spaced from -limit to limit (N·m): a discrete agent's
/// actions.
inline std::vector<double> TorqueLevels(double torque_limit, int64_t count) {
  std::vector<double> levels;
  const auto intervals = static_cast<double>(count - 1);
  for (int64_t i = 0; i < count; ++i) {
    levels.push_back(torque_limit * (2 * static_cast<double>(i) - intervals) / intervals);
  }
  return levels;
}

}  // namespace upswing
