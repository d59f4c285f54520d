#include "agents/task.h"

#include "base/error.h"
#include "base/text.h"
#include "pendulum/acrobot_v1.h"
#include "pendulum/pendulum_v1.h"

namespace upswing {
namespace {

template <typename GymTask>
std::unique_ptr<VectorEnv> MakeGymTask(const EnvConfig& config) {
  return std::make_unique<GymTask>(
      GymTaskConfig{config.num_envs, config.seed, config.stream, config.first_index});
}

template <typename GymTask>
constexpr Task RowOf(const char* name) {
  return {name, MakeGymTask<GymTask>,
          [](const EnvConfig& config) { return MakeGymTask<GymTask>(config)->spec(); }, false,
          nullptr};
}

EnvSpec ForeignSpec(const EnvConfig& config) {
  if (config.task != kGymnasium) throw NoForeignEnvironment(config.task);  // of a policy file
  return ForeignTask::Parse(config.environment, "environment").Spec(config.num_envs);
}

std::unique_ptr<VectorEnv> MakeForeignEnv(const EnvConfig& config) {
  const EnvSpec spec = ForeignSpec(config);
  if (!config.make_foreign) throw NoForeignEnvironment(spec.task);
  return config.make_foreign(config);
}

constexpr Task kTasks[] = {
    {kDoublePendulum,
     [](const EnvConfig& config) -> std::unique_ptr<VectorEnv> {
       return std::make_unique<PendulumEnv>(config);
     },
     [](const EnvConfig& config) { return PendulumSpec(config); }, true, "0,0,0,0"},
    RowOf<PendulumV1>(kPendulumV1),
    RowOf<AcrobotV1>(kAcrobotV1),
    {kGymnasium, MakeForeignEnv, ForeignSpec, false, nullptr},
};

}  // namespace

std::vector<std::string> TaskNames() { return NamesOf(kTasks); }

const Task& TaskNamed(std::string_view name) {
  for (const Task& task : kTasks) {
    if (name == task.name || (task.name == kGymnasium && IsForeign(name))) return task;
  }
  throw BadInput(Concat("task: expected one of ", Join(TaskNames(), ", "), ", got \"", name, "\""));
}

}  // namespace upswing
