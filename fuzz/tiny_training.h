#pragma once

#include <string_view>

#include "apps/config.h"
#include "core/thread_pool.h"
#include "rl/dqn.h"
#include "rl/train.h"
#include "sim/pendulum_env.h"

namespace upswing {

/// A training of a few hundred parameters with nearly everything switched on, in `physics`.
inline Config TinyConfig(const std::string& physics) {
  Config config;
  SetFlags(OptionsOf(config), {{"physics", physics},
                               {"envs", "2"},
                               {"episode_seconds", "0.1"},
                               {"memory", "1"},
                               {"sensor_noise", "0.1"},
                               {"delay", "0.04"},
                               {"randomize", "0.1"},
                               {"hidden", "3,2"},
                               {"head", "2"},
                               {"batch", "4"},
                               {"replay", "6"},
                               {"n_step", "2"},
                               {"learning_starts", "4"},
                               {"updates_per_step", "0.5"}});
  return config;
}

/// All that a checkpoint holds.
struct TinyTraining {
  explicit TinyTraining(const Config& config, ThreadPool& pool)
      : env(config.Environments(pool)),
        agent(config.Agent(env, pool)),
        state(env.num_envs(), kRewardTerms) {}

  void State(const Archive& archive) { CheckpointState(archive, agent, env, state); }

  /// A lock-step of the environments, and what is learned from it.
  void Step() {
    StepResult result = env.MakeResult();
    std::vector<double> torque(static_cast<size_t>(env.num_envs()));
    agent.Act(env.obs(), torque);
    env.Step(torque, result);
    agent.Observe(result);
    state.steps = agent.steps();
    agent.Learn();
    (void)agent.Report();
    (void)state.mean_return();
  }

  PendulumEnv env;
  Dqn agent;
  TrainState state;
};

}  // namespace upswing
