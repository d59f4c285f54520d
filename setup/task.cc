#include "setup/task.h"

#include "core/error.h"
#include "core/text.h"
#include "sim/acrobot_v1.h"
#include "sim/pendulum_v1.h"

namespace upswing {
namespace {

template <typename Task>
std::unique_ptr<VectorEnv> MakeGymTask(const EnvConfig& config) {
  return std::make_unique<Task>(
      GymTaskConfig{config.num_envs, config.seed, config.stream, config.first_index});
}

/// A task's name and how its environments are made.
struct Task {
  const char* name;
  std::unique_ptr<VectorEnv> (*make)(const EnvConfig& config);
};

constexpr Task kTasks[] = {
    {kDoublePendulum,
     [](const EnvConfig& config) -> std::unique_ptr<VectorEnv> {
       return std::make_unique<PendulumEnv>(config);
     }},
    {kPendulumV1, MakeGymTask<PendulumV1>},
    {kAcrobotV1, MakeGymTask<AcrobotV1>},
};

}  // namespace

std::vector<std::string> TaskNames() {
  std::vector<std::string> names;
  for (const Task& task : kTasks) names.emplace_back(task.name);
  return names;
}

std::unique_ptr<VectorEnv> MakeEnv(const EnvConfig& config) {
  for (const Task& task : kTasks) {
    if (config.task == task.name) return task.make(config);
  }
  throw BadInput(
      Concat("task: expected one of ", Join(TaskNames(), ", "), ", got \"", config.task, "\""));
}

EnvSpec SpecOf(const EnvConfig& config) {
  if (config.task == kDoublePendulum) return PendulumSpec(config);  // without making physics
  return MakeEnv(config)->spec();
}

}  // namespace upswing
