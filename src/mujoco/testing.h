#pragma once

#include <gtest/gtest.h>

#include <algorithm>
#include <string>
#include <vector>

#include "base/testing.h"
#include "mujoco/engines.h"
#include "pendulum/pendulum_env.h"

/// Helpers that the tests of environments share.
namespace upswing {

/// The engines, as values of a parametrised test, and their names in it.
inline auto EachEngine() { return testing::Values(&kMuJoCo, &kClosedForm); }
inline std::string EngineName(const testing::TestParamInfo<const Engine*>& info) {
  return info.param == &kMuJoCo ? "MuJoCo" : "ClosedForm";
}

/// Expects saved environments to continue with the same bits in others that load them. Saves after
/// `steps_before` steps, then compares twelve more. Episodes should be short enough that some of
/// them end.
inline void ExpectLoadedGoesOn(const PendulumEnvConfig& config, int steps_before) {
  PendulumEnv saved(config), loaded(config);
  StepResult a = saved.MakeResult(), b = saved.MakeResult();
  std::vector<double> torque;  // 1, 2, … N·m
  for (int i = 1; i <= config.num_envs; ++i) torque.push_back(i);
  for (int step = 0; step < steps_before; ++step) saved.Step(torque, a);
  SaveAndLoad([&](const Archive& archive) { saved.State(archive); },
              [&](const Archive& archive) { loaded.State(archive); });
  EXPECT_TRUE(std::ranges::equal(saved.obs().values(), loaded.obs().values()));
  for (int step = 0; step < 12; ++step) {
    saved.Step(torque, a);
    loaded.Step(torque, b);
    ASSERT_EQ(a.next_obs, b.next_obs);
    ASSERT_EQ(a.reward, b.reward);
    ASSERT_EQ(a.torque, b.torque);
    ASSERT_EQ(a.truncated, b.truncated);
    ASSERT_TRUE(std::ranges::equal(saved.obs().values(), loaded.obs().values()));
  }
  for (int i = 0; i < config.num_envs; ++i) {
    EXPECT_EQ(saved.plant(i).length1, loaded.plant(i).length1);
  }
}

}  // namespace upswing
