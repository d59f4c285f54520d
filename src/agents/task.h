#pragma once

#include <memory>
#include <string>
#include <string_view>
#include <vector>

#include "agents/foreign_task.h"
#include "base/env.h"
#include "pendulum/pendulum_env.h"

namespace upswing {

/// Settings of environments of any task. Tasks other than the double pendulum use only the number
/// of environments and their random streams.
struct EnvConfig : PendulumEnvConfig {
  std::string task = kDoublePendulum;
  // Of a foreign task:
  std::string environment;      // description, see ForeignTask::Parse
  ForeignMaker make_foreign;    // empty: this program cannot make the environments
  bool for_evaluation = false;  // environments need not go on after their first episode
};

/// A task, as the program uses it.
struct Task {
  const char* name;
  std::unique_ptr<VectorEnv> (*make)(const EnvConfig& config);
  /// The EnvSpec of the environments of `make`, without making physics.
  EnvSpec (*spec)(const EnvConfig& config);
  bool has_plant;           // with engine, sensors, curriculum; can be mapped, viewed, changed
  const char* usual_start;  // start of an episode that names none; null: the task draws one
};

/// The tasks' names, the default first.
std::vector<std::string> TaskNames();

/// The task called `name`. Throws BadInput if there is none.
const Task& TaskNamed(std::string_view name);

inline bool HasPlant(std::string_view task) { return TaskNamed(task).has_plant; }

/// Makes the environments of a task. Throws BadInput as the task does.
inline std::unique_ptr<VectorEnv> MakeEnv(const EnvConfig& config) {
  return TaskNamed(config.task).make(config);
}

/// The EnvSpec of the environments of MakeEnv, without making them.
inline EnvSpec SpecOf(const EnvConfig& config) { return TaskNamed(config.task).spec(config); }

}  // namespace upswing
