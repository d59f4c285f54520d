#include "setup/task.h"

#include "core/error.h"
#include "core/text.h"
#include "sim/acrobot_v1.h"
#include "sim/pendulum_v1.h"

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

constexpr Task kTasks[] = {
    {kDoublePendulum,
     [](const EnvConfig& config) -> std::unique_ptr<VectorEnv> {
       return std::make_unique<PendulumEnv>(config);
     },
     [](const EnvConfig& config) { return PendulumSpec(config); }, true, "0,0,0,0"},
    RowOf<PendulumV1>(kPendulumV1),
    RowOf<AcrobotV1>(kAcrobotV1),
};

}  // namespace

std::vector<std::string> TaskNames() { return NamesOf(kTasks); }

const Task& TaskNamed(std::string_view name) {
  for (const Task& task : kTasks) {
    if (name == task.name) return task;
  }
  throw BadInput(Concat("task: expected one of ", Join(TaskNames(), ", "), ", got \"", name, "\""));
}

}  // namespace upswing
