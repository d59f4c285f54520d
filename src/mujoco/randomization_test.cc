#include "pendulum/randomization.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>

#include "base/error.h"
#include "mujoco/testing.h"
#include "pendulum/pendulum_env.h"

namespace upswing {
namespace {

/// A plant's numbers, in the order of its settings.
std::array<double, 8> NumbersOf(const Plant& p) {
  return {p.mass1,    p.mass2,    p.length1, p.length2,
          p.damping1, p.damping2, p.gravity, p.torque_limit};
}

Randomization Box(std::array<double, 8> plant) {
  Randomization box;
  box.plant = plant;
  return box;
}

TEST(Randomization, SettingsAreCheckedAndHaveAliases) {
  Randomization box;
  const Options options = OptionsOf(box);
  EXPECT_FALSE(box.any());
  for (const char* bad : {"1", "-0.1", "25%", "nan"}) {
    EXPECT_THROW(options.Set("randomize_mass1", bad, "test"), Error) << bad;
    EXPECT_THROW(options.Set("randomize", bad, "test"), Error) << bad;
  }
  EXPECT_THROW(options.Set("randomize_delay", "-0.02", "test"), Error);
  EXPECT_THROW(options.Set("randomize_sensor_latency", "0.2", "test"), Error);
  options.Set("randomize", "0.25", "test");
  options.Set("randomize_length", "0.1", "test");
  EXPECT_EQ(box.plant, (std::array{0.25, 0.25, 0.1, 0.1, 0.25, 0.25, 0.25, 0.0}));
  EXPECT_TRUE(box.any());
}

TEST(Randomization, PlantsAreUniformInTheBoxAndTheirNumbersIndependent) {
  constexpr int kCount = 20000;
  const Randomization box = Box({0.25, 0.2, 0.15, 0.1, 0.5, 0.99, 0.3, 0.05});
  const Plant nominal;
  const auto middle = NumbersOf(nominal);
  Rng rng(1, "test");
  std::array<double, 8> sum{}, lowest{}, highest{};
  std::array<std::array<double, 8>, 8> product{};
  for (int n = 0; n < kCount; ++n) {
    const auto drawn = NumbersOf(box.Draw(nominal, rng));
    std::array<double, 8> u;  // in [-1, 1]
    for (size_t k = 0; k < 8; ++k) {
      u[k] = (drawn[k] / middle[k] - 1) / box.plant[k];
      ASSERT_LE(std::abs(u[k]), 1 + 1e-12);
      lowest[k] = std::min(lowest[k], u[k]);
      highest[k] = std::max(highest[k], u[k]);
      sum[k] += u[k];
    }
    for (size_t j = 0; j < 8; ++j) {
      for (size_t k = 0; k < 8; ++k) product[j][k] += u[j] * u[k];
    }
  }
  // Tolerance: five standard errors. For u uniform, var u = 1/3, var u² = 1/5 - 1/9, var (u v) =
  // 1/9.
  for (size_t j = 0; j < 8; ++j) {
    EXPECT_NEAR(sum[j] / kCount, 0, 5 * std::sqrt(1 / 3.0 / kCount));
    EXPECT_LT(lowest[j], -0.99);
    EXPECT_GT(highest[j], 0.99);
    for (size_t k = 0; k < 8; ++k) {
      const double variance = j == k ? 1 / 5.0 - 1 / 9.0 : 1 / 9.0;
      EXPECT_NEAR(product[j][k] / kCount, j == k ? 1 / 3.0 : 0, 5 * std::sqrt(variance / kCount));
    }
  }
}

TEST(Randomization, AParameterWithoutWidthStaysAndChangesNothingElse) {
  Rng a(1, "test"), b(1, "test");
  Plant heavy;
  heavy.mass2 = 3;
  const Plant one = Box({0, 0.2, 0, 0, 0, 0, 0, 0}).Draw(heavy, a);
  const Plant all = Box({0.1, 0.2, 0.3, 0.1, 0.1, 0.1, 0.1, 0.1}).Draw(heavy, b);
  EXPECT_EQ(one.mass2, all.mass2);
  EXPECT_NE(one.mass2, 3);
  EXPECT_EQ(one.mass1, 1);
  EXPECT_EQ(one.gravity, 9.81);
  EXPECT_EQ(a.Next(), b.Next());
}

TEST(Randomization, DisturbancesGoFromTheNominalUpwards) {
  constexpr int kCount = 4000;
  Randomization box;
  box.sensor_noise = 0.1;
  box.delay = 0.06;
  Rng rng(1, "test");
  std::array<int, 6> delays{};
  double sum = 0;
  for (int n = 0; n < kCount; ++n) {
    const Disturbance drawn = box.Draw(Disturbance{0.2, 0.04}, kControlPeriod, rng);
    ASSERT_GE(drawn.sensor_noise, 0.2);
    ASSERT_LE(drawn.sensor_noise, 0.3);
    sum += drawn.sensor_noise;
    ++delays.at(static_cast<size_t>(drawn.delay_steps(kControlPeriod)));
  }
  EXPECT_NEAR(sum / kCount, 0.25, 5 * 0.1 / std::sqrt(12.0 * kCount));
  for (size_t k = 0; k < delays.size(); ++k) {
    EXPECT_NEAR(delays[k], k < 2 ? 0 : kCount / 4.0, k < 2 ? 0 : 5 * std::sqrt(kCount * 3 / 16.0));
  }
}

TEST(Randomization, ARandomLatencyLeavesTheOtherDraws) {
  Randomization box;
  box.sensor_noise = 0.1;
  Rng rng(1, "test"), same(1, "test");
  const Disturbance nominal{0.2, 0.04, {0.01, 4096, 0.01, 0.02}};
  const Disturbance before = box.Draw(nominal, kControlPeriod, rng);
  EXPECT_EQ(before.sensors.latency, 0.01);
  EXPECT_EQ(before.sensors.encoder_counts, 4096);
  box.sensor_latency = 0.03;
  const Disturbance drawn = box.Draw(nominal, kControlPeriod, same);
  EXPECT_EQ(drawn.sensor_noise, before.sensor_noise);
  EXPECT_GT(drawn.sensors.latency, 0.01);
  EXPECT_LE(drawn.sensors.latency, box.Largest(nominal).sensors.latency);
  EXPECT_EQ(drawn.sensors.velocity_filter, 0.02);
  EXPECT_NE(rng.Next(), same.Next());
}

class RandomizedEnvs : public testing::TestWithParam<const Engine*> {
 protected:
  static PendulumEnvConfig Config(int num_envs) {
    PendulumEnvConfig config;
    config.engine = GetParam();
    config.num_envs = num_envs;
    config.episode_seconds = 0.1;  // five steps
    config.randomization = Box({0.25, 0.25, 0.25, 0.25, 0.25, 0.25, 0.25, 0.5});
    config.randomization.sensor_noise = 0.05;
    config.randomization.delay = 0.04;
    return config;
  }
};

INSTANTIATE_TEST_SUITE_P(Physics, RandomizedEnvs, EachEngine(), EngineName);

TEST_P(RandomizedEnvs, EveryEpisodeMovesAsItsOwnPlantDoes) {
  PendulumEnvConfig config = Config(3);
  config.randomization.sensor_noise = 0;
  config.randomization.delay = 0;
  PendulumEnv env(config);
  StepResult result = env.MakeResult();
  std::vector<double> masses;
  for (int episode = 0; episode < 4; ++episode) {
    // The same three plants and starts, in environments that only ever have one plant.
    PendulumEnvConfig fixed;
    fixed.engine = GetParam();
    fixed.num_envs = 3;
    fixed.plants = {env.plant(0), env.plant(1), env.plant(2)};
    PendulumEnv reference(fixed);
    StepResult expected = reference.MakeResult();
    for (int i = 0; i < 3; ++i) {
      masses.push_back(env.plant(i).mass1);
      reference.SetState(i, env.state(i));
    }
    EXPECT_TRUE(std::ranges::equal(env.obs().values(), reference.obs().values()));
    for (int step = 0; step < 5; ++step) {
      const std::vector<double> torque{4, -9, 9.0 * step};
      env.Step(torque, result);
      reference.Step(torque, expected);
      ASSERT_EQ(result.next_obs, expected.next_obs);
      ASSERT_EQ(result.reward, expected.reward);
      ASSERT_EQ(result.torque, expected.torque);
      ASSERT_EQ(result.work, expected.work);
    }
  }
  // Twelve episodes have twelve plants.
  std::ranges::sort(masses);
  EXPECT_EQ(std::ranges::adjacent_find(masses), masses.end());
}

TEST_P(RandomizedEnvs, StartsEqualTheStartsOfOnePlantAndStreamsAreNamed) {
  PendulumEnvConfig config = Config(2);
  const PendulumEnv random(config);
  PendulumEnvConfig plain = config;
  plain.randomization = Randomization();
  const PendulumEnv one(plain);
  for (int i = 0; i < 2; ++i) EXPECT_EQ(random.state(i).w2, one.state(i).w2);
  EXPECT_EQ(one.plant(1).mass1, 1);
  config.stream = "another";
  EXPECT_NE(random.plant(0).mass1, PendulumEnv(config).plant(0).mass1);
  // The plants of an environment do not depend on the number of environments.
  EXPECT_EQ(random.plant(1).gravity, PendulumEnv(Config(9)).plant(1).gravity);
  EXPECT_EQ(random.spec().action_limit.front(), 5);
}

TEST_P(RandomizedEnvs, ARestartWithASeedGivesTheEpisodesOfANewEnvironment) {
  PendulumEnvConfig config = Config(3);
  PendulumEnv env(config);
  StepResult result = env.MakeResult();
  const std::vector<double> torque{1, -2, 3};
  for (int step = 0; step < 7; ++step) env.Step(torque, result);
  env.Restart(1, 99);
  config.seed = 99;
  config.num_envs = 1;
  PendulumEnv fresh(config);
  StepResult expected = fresh.MakeResult();
  for (int step = 0; step < 12; ++step) {  // three episodes
    ASSERT_TRUE(std::ranges::equal(env.obs().row(1), fresh.obs().row(0)));
    ASSERT_EQ(env.plant(1).gravity, fresh.plant(0).gravity);
    env.Step(torque, result);
    fresh.Step(std::vector<double>{-2}, expected);
    ASSERT_EQ(result.reward[1], expected.reward[0]);
    ASSERT_EQ(result.truncated[1], expected.truncated[0]);
  }
}

TEST_P(RandomizedEnvs, ARestartWithoutASeedIsAnotherEpisodeOfItsOwn) {
  PendulumEnv env(Config(2)), same(Config(2));
  const double before = env.state(0).w1;
  env.Restart(0, std::nullopt);
  EXPECT_NE(env.state(0).w1, before);
  EXPECT_NE(env.plant(0).mass1, same.plant(0).mass1);
  // The other environment is unchanged.
  EXPECT_EQ(env.state(1).w1, same.state(1).w1);
  // Without a seed, Restart begins the episode that would follow anyway.
  StepResult result = same.MakeResult();
  for (int step = 0; step < 5; ++step) same.Step(std::vector<double>{0, 0}, result);
  EXPECT_EQ(env.state(0).w1, same.state(0).w1);
  EXPECT_EQ(env.plant(0).mass1, same.plant(0).mass1);
}

TEST_P(RandomizedEnvs, AStepKeepsHeldEnvironments) {
  PendulumEnvConfig config = Config(3);
  config.memory = 2;
  config.disturbances = {Disturbance{0, 0.02}};
  PendulumEnv env(config), reference(config);
  StepResult result = env.MakeResult(), expected = reference.MakeResult();
  const std::vector<double> torque{1, -2, 3};
  env.Step(torque, result);
  reference.Step(torque, expected);
  env.Hold(1);
  env.Step(torque, result);
  const auto D = static_cast<size_t>(env.spec().obs_size);
  EXPECT_TRUE(std::ranges::equal(std::span(result.next_obs).subspan(D, D),
                                 std::span(expected.next_obs).subspan(D, D)));
  EXPECT_EQ(env.state(1).w1, reference.state(1).w1);
  EXPECT_NE(env.state(0).w1, reference.state(0).w1);
  EXPECT_EQ(result.reward[1], 0);
  EXPECT_EQ(result.torque[1], 0);
  EXPECT_NE(result.reward[0], 0);
  // From here on, environment 1 lags behind by one step, but is otherwise the same, noise and delay
  // included.
  for (int step = 0; step < 9; ++step) {
    env.Step(torque, result);
    reference.Step(torque, expected);
    ASSERT_EQ(result.reward[1], expected.reward[1]);
    ASSERT_EQ(result.truncated[1], expected.truncated[1]);
    ASSERT_TRUE(std::ranges::equal(env.obs().row(1), reference.obs().row(1)));
  }
}

TEST_P(RandomizedEnvs, LoadedStateContinuesWithTheSameBits) {
  ExpectLoadedGoesOn(Config(3), 8);  // in the second episode
}

TEST_P(RandomizedEnvs, APosteriorDrawsPlantsAndLatencies) {
  PendulumEnvConfig config = Config(3);
  config.randomization = Randomization();
  config.randomization.from_posterior = true;
  EXPECT_THROW(PendulumEnv{config}, Error);
  config.randomization.posterior =
      "center1 1e-4; coulomb1 0 1e-2; inertia2 1e-6 0 1e-6; sensor_latency 0 0 0 1e-6";
  for (Plant& plant : config.plants) {
    plant.center1 = 0.25;
    plant.coulomb1 = 0.3;
    plant.inertia2 = 0.03;
  }
  config.disturbances.front().sensors.latency = 0.01;
  const PendulumEnv env(config);
  for (int i = 1; i < 3; ++i) {
    EXPECT_NE(env.plant(i).center1, env.plant(0).center1);
    EXPECT_NE(env.plant(i).coulomb1, env.plant(0).coulomb1);
    EXPECT_NE(env.disturbance(i).sensors.latency, env.disturbance(0).sensors.latency);
    EXPECT_EQ(env.plant(i).mass1, 1);
  }
  // The number of environments changes no plant.
  config.num_envs = 9;
  EXPECT_EQ(PendulumEnv(config).plant(2).inertia2, env.plant(2).inertia2);
  config.num_envs = 3;
  ExpectLoadedGoesOn(config, 8);  // in the second episode
}

TEST(RandomizedEnv, BothPhysicsAgreeOverManyResets) {
  constexpr int kEnvs = 9;  // more than one MuJoCo batch
  PendulumEnvConfig config;
  config.num_envs = kEnvs;
  config.episode_seconds = 0.2;
  config.start.random_share = 0.5;
  config.randomization = Box({0.5, 0.5, 0.5, 0.5, 0.5, 0.5, 0.5, 0.5});
  PendulumEnv mujoco(config);
  config.engine = &kClosedForm;
  PendulumEnv twin(config);
  StepResult a = mujoco.MakeResult(), b = twin.MakeResult();
  Rng rng(1, "torques");
  std::vector<double> torque(kEnvs);
  for (int step = 0; step < 305; ++step) {  // past thirty resets
    for (double& x : torque) x = rng.Uniform(-8, 8);
    mujoco.Step(torque, a);
    twin.Step(torque, b);
    ASSERT_EQ(a.torque, b.torque);
    for (int i = 0; i < kEnvs; ++i) {
      ASSERT_NEAR(a.reward[static_cast<size_t>(i)], b.reward[static_cast<size_t>(i)], 1e-9);
      ASSERT_NEAR(mujoco.state(i).q1, twin.state(i).q1, 1e-9);
      ASSERT_NEAR(mujoco.state(i).w2, twin.state(i).w2, 1e-9);
    }
  }
}

}  // namespace
}  // namespace upswing
