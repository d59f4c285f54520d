#pragma once

#include <cstdint>
#include <vector>

#include "base/env.h"
#include "base/error.h"
#include "base/text.h"

namespace upswing {

/// Actions of a discrete agent: `count` torques (at least 2), evenly spaced from -torque_limit to
/// torque_limit (N·m).
inline std::vector<double> TorqueLevels(double torque_limit, int64_t count) {
  std::vector<double> levels;
  const auto intervals = static_cast<double>(count - 1);
  for (int64_t i = 0; i < count; ++i) {
    levels.push_back(torque_limit * (2 * static_cast<double>(i) - intervals) / intervals);
  }
  return levels;
}

/// The actions of a discrete agent: the task's choices, or else `count` levels of its only torque.
/// Throws BadInput that begins with `agent` if the task has several torques.
inline std::vector<double> ActionTable(const EnvSpec& spec, int64_t count, const char* agent) {
  if (spec.action_size() != 1) {
    throw BadInput(Concat(agent, ": expected a task with one torque, got ", spec.action_size(),
                          " in ", spec.task));
  }
  return spec.choices.empty() ? TorqueLevels(spec.action_limit.front(), count) : spec.choices;
}

}  // namespace upswing
