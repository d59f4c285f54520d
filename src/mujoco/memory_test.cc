#include <gtest/gtest.h>

#include <algorithm>

#include "mujoco/testing.h"
#include "pendulum/pendulum_env.h"

namespace upswing {
namespace {

class RememberingEnvs : public testing::TestWithParam<const Engine*> {
 protected:
  static PendulumEnvConfig Config(int memory) {
    PendulumEnvConfig config;
    config.engine = GetParam();
    config.num_envs = 3;
    config.episode_seconds = 0.1;  // five steps
    config.memory = memory;
    return config;
  }
};

INSTANTIATE_TEST_SUITE_P(Physics, RememberingEnvs, EachEngine(), EngineName);

TEST_P(RememberingEnvs, ObservationsEndWithTorquesAndChangesOfVelocities) {
  PendulumEnv env(Config(2)), plain(Config(0));
  ASSERT_EQ(env.spec().obs_size, kObservationSize + 6);
  StepResult result = env.MakeResult(), expected = plain.MakeResult();
  std::vector<PendulumState> states{env.state(1)};  // of the running episode, latest last
  std::vector<double> torques;                      // the torque after each state, N·m
  for (int step = 1; step <= 12; ++step) {          // past two resets
    const double torque = step % 4 - 1.5;
    torques.push_back(torque);
    env.Step(std::vector<double>{0, torque, 7}, result);
    plain.Step(std::vector<double>{0, torque, 7}, expected);
    const bool done = step % 5 == 0;
    ASSERT_EQ(result.truncated[1], done);
    if (!done) states.push_back(env.state(1));

    for (int i = 0; i < 3; ++i) {
      const size_t row = static_cast<size_t>(i) * (kObservationSize + 6);
      // The observation begins with the observation without memory, with the same bits.
      EXPECT_TRUE(std::ranges::equal(
          std::span(result.next_obs).subspan(row, kObservationSize),
          std::span(expected.next_obs)
              .subspan(static_cast<size_t>(i) * kObservationSize, kObservationSize)));
      EXPECT_TRUE(std::ranges::equal(env.obs().row(i).first(kObservationSize), plain.obs().row(i)));
    }

    // Check the memory of the next observation; torques are scaled by 5 N·m.
    const auto memory = env.obs().row(1).subspan(kObservationSize);
    if (done) {
      states = {env.state(1)};
      torques.clear();
      // The last observation of a finished episode has a memory too.
      EXPECT_NEAR(result.next_obs[2 * kObservationSize + 6 + 2], torque / 5, 1e-7);
    }
    for (size_t j = 0; j < 2; ++j) {
      const size_t n = states.size();
      const bool known = n >= j + 2;
      const PendulumState after = known ? states[n - 1 - j] : PendulumState();
      const PendulumState before = known ? states[n - 2 - j] : PendulumState();
      EXPECT_NEAR(memory[3 * j], after.w1 - before.w1, 1e-5) << step;
      EXPECT_NEAR(memory[3 * j + 1], after.w2 - before.w2, 1e-5) << step;
      EXPECT_NEAR(memory[3 * j + 2], known ? torques[n - 2 - j] / 5 : 0, 1e-7) << step;
    }
  }
}

TEST_P(RememberingEnvs, WithADelayTheMemoryHasTheWaitingTorques) {
  PendulumEnvConfig config = Config(2);
  config.disturbances = {Disturbance{0, 0.04}};
  PendulumEnv env(config);
  StepResult result = env.MakeResult();
  for (const double torque : {1.0, 2.0, 3.0}) env.Step(std::vector<double>(3, torque), result);
  const auto memory = env.obs().row(0).subspan(kObservationSize);
  EXPECT_NEAR(memory[2], 3.0 / 5, 1e-7);
  EXPECT_NEAR(memory[5], 2.0 / 5, 1e-7);
  EXPECT_EQ(result.torque[0], 1);
}

TEST_P(RememberingEnvs, MirroringNegatesTheMemory) {
  PendulumEnv env(Config(2));
  StepResult result = env.MakeResult();
  env.SetState(0, {0.3, -0.5, 1, -2});
  env.SetState(1, {-0.3, 0.5, -1, 2});
  for (const double torque : {1.0, -3.0, 2.0}) env.Step(std::vector{torque, -torque, 0.0}, result);
  const std::vector<float> signs = env.spec().mirror_signs;
  ASSERT_EQ(static_cast<int>(signs.size()), env.spec().obs_size);
  for (size_t k = 0; k < signs.size(); ++k) {
    EXPECT_NEAR(env.obs().row(0)[k], signs[k] * env.obs().row(1)[k], 1e-6) << k;
    EXPECT_NE(env.obs().row(0)[k], 0) << k;
  }
}

TEST_P(RememberingEnvs, LoadedStateContinuesWithTheSameBits) { ExpectLoadedGoesOn(Config(3), 7); }

}  // namespace
}  // namespace upswing
