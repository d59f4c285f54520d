#pragma once

#include <gtest/gtest.h>

#include <algorithm>
#include <limits>
#include <string>
#include <vector>

#include "base/safetensors.h"
#include "base/testing.h"
#include "rl/agent.h"
#include "rl/off_policy_config.h"
#include "rl/toy_env_testing.h"

/// Helpers for tests of agents.
namespace upswing {

/// The metric called `name`. Fails the test if there is none.
inline double Metric(const Metrics& metrics, const std::string& name) {
  const auto found = std::ranges::find(metrics, name, &Metrics::value_type::first);
  EXPECT_NE(found, metrics.end()) << name;
  return found == metrics.end() ? std::numeric_limits<double>::quiet_NaN() : found->second;
}

/// Makes an agent with a replay memory small and fast enough for tests, with plain one-step
/// targets.
inline void MakeSmall(OffPolicyConfig& off_policy) {
  off_policy.batch = 16;
  off_policy.replay = 1000;
  off_policy.learning_starts = 32;
  off_policy.updates_per_step = 0.5;
  off_policy.n_step = 1;
  off_policy.reward_scale = 1;
  off_policy.reward_centering = 0;
}

/// Trains on an environment for `steps` steps of all environments.
inline void Walk(Agent& agent, VectorEnv& env, int steps) {
  StepResult result(env.spec());
  std::vector<double> torques(result.torque.size());
  const Matrix<double> action(torques, env.num_envs(), env.spec().action_size());
  for (int i = 0; i < steps; ++i) {
    agent.Act(env.obs(), action);
    env.Step(action, result);
    agent.Observe(result);
    agent.Learn();
  }
}

/// The action of the exported policy at an observation.
inline double ActionAt(const Agent& agent, float x) {
  const auto policy = agent.ExportPolicy({});
  double action = 99;
  policy->Act({&x, 1, 1}, {&action, 1, 1}, *policy->Start(1));
  return action;
}

/// The agent's whole state.
inline std::vector<std::byte> BytesOf(Agent& agent) {
  Tensors state;
  agent.State(Archive::Saver(state));
  return WriteSafetensors(state).Joined();
}

/// Expects that 1 and 3 threads learn the same bits on toy environments.
template <typename TestedAgent, typename Config>
void ExpectThreadsChangeNoBit(const Config& config, int num_envs, int steps) {
  std::vector<std::byte> first;
  for (const int threads : {1, 3}) {
    ThreadPool pool(threads);
    TestedAgent agent(config, ToyEnv::Spec(num_envs), 1, pool);
    ToyEnv env(num_envs);
    Walk(agent, env, steps);
    EXPECT_GT(agent.updates(), 0);
    if (threads == 1) first = BytesOf(agent);
    EXPECT_EQ(BytesOf(agent), first);
  }
}

/// Expects that an agent and its environments, saved after `steps` steps and loaded into others
/// with another seed, go on with the same bits.
template <typename TestedAgent, typename Config>
void ExpectLoadedStateGoesOn(const Config& config, int steps) {
  ThreadPool pool(1);
  TestedAgent saved(config, ToyEnv::Spec(2), 1, pool);
  TestedAgent loaded(config, ToyEnv::Spec(2), 99, pool);
  ToyEnv env(2), loaded_env(2, 99);
  Walk(saved, env, steps);
  const auto state = [](Agent& agent, ToyEnv& toy) {
    return [&](const Archive& archive) {
      agent.State(archive.In("agent"));
      toy.State(archive.In("env"));
    };
  };
  SaveAndLoad(state(saved, env), state(loaded, loaded_env));
  EXPECT_EQ(saved.TakeMetrics(), loaded.TakeMetrics());
  Walk(saved, env, 100);
  Walk(loaded, loaded_env, 100);
  EXPECT_EQ(BytesOf(saved), BytesOf(loaded));
  EXPECT_EQ(saved.TakeMetrics(), loaded.TakeMetrics());
}

/// Expects that an observation that is not finite ends the learning.
template <typename TestedAgent, typename Config>
void ExpectPoisonFails(const Config& config) {
  ThreadPool pool(1);
  TestedAgent agent(config, ToyEnv::Spec(1), 1, pool);
  ToyEnv env(1);
  env.poison = true;
  EXPECT_THROW(Walk(agent, env, 1), Error);
}

}  // namespace upswing
