#pragma once

#include <memory>
#include <string>
#include <string_view>
#include <vector>

#include "core/env.h"
#include "sim/pendulum_env.h"

namespace upswing {

/// Settings of environments of any task. Of the settings below, tasks other than the double
/// pendulum take the number of environments and their random streams.
struct EnvConfig : PendulumEnvConfig {
  std::string task = kDoublePendulum;
};

/// What the program asks of a task.
struct Task {
  const char* name;
  std::unique_ptr<VectorEnv> (*make)(const EnvConfig& config);
  /// What `make`'s environments are, without making physics.
  EnvSpec (*spec)(const EnvConfig& config);
  bool has_plant;           // with engine, sensors and curriculum: can be mapped, viewed, changed
  const char* usual_start;  // of an episode that is no other's; null: a start of its own
};

/// The tasks' names, the default first.
std::vector<std::string> TaskNames();

/// The task of this name. Throws BadInput.
const Task& TaskNamed(std::string_view name);

inline bool HasPlant(std::string_view task) { return TaskNamed(task).has_plant; }

/// Throws BadInput as the task does.
inline std::unique_ptr<VectorEnv> MakeEnv(const EnvConfig& config) {
  return TaskNamed(config.task).make(config);
}

/// What MakeEnv's environments are, without making them.
inline EnvSpec SpecOf(const EnvConfig& config) { return TaskNamed(config.task).spec(config); }

}  // namespace upswing
