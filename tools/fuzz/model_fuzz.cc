// Target: a model in MJCF, from --model, a run folder or a policy.
#include "mujoco/engines.h"
#include "mujoco/model.h"
#include "pendulum/pendulum_env.h"
#include "tools/fuzz/target.h"

namespace upswing {

bool TryInput(std::string_view input) {
  const std::string mjcf(input);
  PendulumEnvConfig config;
  config.num_envs = 1;
  config.mjcf = mjcf;
  config.engine = &kMuJoCo;
  if (!Accepts([&] { config.plants = {LoadModel(mjcf, kInputName).plant}; })) return false;
  // An accepted model can be simulated.
  PendulumEnv env(config);
  StepResult result = env.MakeResult();
  const double torque = 1;
  for (int step = 0; step < 3; ++step) env.Step(std::span(&torque, 1), result);
  return true;
}

}  // namespace upswing
