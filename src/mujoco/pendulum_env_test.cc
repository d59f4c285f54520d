#include "pendulum/pendulum_env.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>

#include "base/error.h"
#include "base/rng.h"
#include "base/testing.h"
#include "base/text.h"
#include "mujoco/testing.h"

namespace upswing {
namespace {

/// Properties of the environment, for each engine.
class PendulumEnvs : public testing::TestWithParam<const Engine*> {
 protected:
  static PendulumEnvConfig Config() {
    PendulumEnvConfig config;
    config.engine = GetParam();
    return config;
  }
  static PendulumEnvConfig SmallConfig();
};

INSTANTIATE_TEST_SUITE_P(Physics, PendulumEnvs, EachEngine(), EngineName);

PendulumEnvConfig PendulumEnvs::SmallConfig() {
  PendulumEnvConfig config = Config();
  config.num_envs = 3;
  config.episode_seconds = 0.1;  // five steps
  config.seed = 4;
  return config;
}

TEST_P(PendulumEnvs, TruncatesWithTheTrueSuccessorAndThenResets) {
  PendulumEnv env(SmallConfig());
  // A second set of environments with the same starts, but longer episodes that go on after step
  // five.
  PendulumEnvConfig longer = SmallConfig();
  longer.episode_seconds = 1;
  PendulumEnv reference(longer);
  StepResult result = env.MakeResult(), expected = reference.MakeResult();
  const std::vector<double> torque{1, -2, 3};
  for (int step = 1; step <= 5; ++step) {
    env.Step(torque, result);
    reference.Step(torque, expected);
    EXPECT_EQ(result.next_obs, expected.next_obs);
    EXPECT_EQ(result.reward, expected.reward);
    for (size_t i = 0; i < 3; ++i) {
      EXPECT_EQ(result.truncated[i], step == 5);
      EXPECT_EQ(result.terminated[i], 0);
    }
  }
  // The next observation is a new start, not the successor.
  const auto next = std::span<const float>(result.next_obs);
  EXPECT_FALSE(std::ranges::equal(env.obs().values(), next));
  EXPECT_TRUE(std::ranges::equal(reference.obs().values(), next));
  EXPECT_LT(std::abs(env.state(0).q1), 0.5);
  env.Step(torque, result);
  EXPECT_EQ(result.truncated[0], 0);
}

TEST_P(PendulumEnvs, APartOfTheEnvironmentsIsAsThoseOfTheWhole) {
  PendulumEnvConfig whole = SmallConfig();
  whole.disturbances = {{0.02, 0}};
  whole.randomization.plant.fill(0.2);
  PendulumEnvConfig part = whole;
  part.num_envs = 2;
  part.first_index = 1;
  PendulumEnv all(whole), last(part);
  StepResult expected = all.MakeResult(), result = last.MakeResult();
  for (int step = 0; step < 8; ++step) {  // past a reset
    all.Step(std::vector<double>{1, 2, 3}, expected);
    last.Step(std::vector<double>{2, 3}, result);
    ASSERT_EQ(all.state(1).q2, last.state(0).q2);
    ASSERT_TRUE(std::ranges::equal(all.obs().row(2), last.obs().row(1)));
  }
}

TEST_P(PendulumEnvs, ObservationsUseTheAssumedPlantOnly) {
  PendulumEnvConfig config = SmallConfig();
  config.randomization.plant.fill(0.3);
  PendulumEnvConfig blind = config;
  blind.assumed_plant = Plant();
  PendulumEnv usual(config), env(blind);
  StepResult expected = usual.MakeResult(), result = env.MakeResult();
  for (int step = 0; step < 8; ++step) {  // past a reset
    for (int i = 0; i < 3; ++i) {
      const auto seen = Observe(Plant(), env.state(i));
      ASSERT_TRUE(std::ranges::equal(env.obs().row(i), seen));
      ASSERT_FALSE(std::ranges::equal(usual.obs().row(i), seen));
      ASSERT_EQ(env.state(i).q2, usual.state(i).q2);  // the motion uses the true plant
    }
    usual.Step(std::vector<double>{1, 2, 3}, expected);
    env.Step(std::vector<double>{1, 2, 3}, result);
    ASSERT_EQ(result.reward, expected.reward);
  }
}

TEST_P(PendulumEnvs, ReturnsTheDisturbanceOfTheRunningEpisode) {
  PendulumEnvConfig config = SmallConfig();
  EXPECT_EQ(PendulumEnv(config).disturbance(0).delay, 0);
  config.disturbances = {{0.01, 0.02}};
  EXPECT_EQ(PendulumEnv(config).disturbance(1).sensor_noise, 0.01);
  config.randomization.delay = 0.1;
  config.randomization.sensor_noise = 0.1;
  const PendulumEnv env(config);
  EXPECT_GE(env.disturbance(0).delay, 0.02);
  EXPECT_GT(env.disturbance(0).sensor_noise, 0.01);
  EXPECT_NE(env.disturbance(0).sensor_noise, env.disturbance(1).sensor_noise);
}

TEST_P(PendulumEnvs, LinksLeanFromStraightUp) {
  constexpr double kPi = std::numbers::pi;
  PendulumEnv env(SmallConfig());
  ASSERT_EQ(env.spec().bodies, 2);
  std::array<double, 2> lean{};
  const auto of = [&](double q1, double q2) {
    env.SetState(1, {q1, q2, 0, 0});
    env.Lean(1, lean);
    return lean;
  };
  EXPECT_NEAR(of(kPi + 0.1, -0.3)[0], 0.1, 1e-12);
  EXPECT_NEAR(lean[1], -0.2, 1e-12);
  EXPECT_NEAR(of(-3 * kPi - 0.1, 0)[0], -0.1, 1e-12);  // full turns do not matter
  EXPECT_NEAR(std::abs(of(0, 0)[1]), kPi, 1e-12);      // hanging
}

TEST(PendulumEnv, APushAddsToTheMotorUntilTheNextState) {
  PendulumEnvConfig config;
  config.engine = &kMuJoCo;
  PendulumEnv pushed(config), driven(config);
  StepResult result = pushed.MakeResult();
  const PendulumState start{0.3, -0.2, 1, 0};
  pushed.SetState(0, start);
  driven.SetState(0, start);
  const auto difference = [&] {
    const PendulumState a = pushed.state(0), b = driven.state(0);
    return std::hypot(a.q1 - b.q1, a.q2 - b.q2, a.w1 - b.w1) + std::abs(a.w2 - b.w2);
  };
  // A push about the first joint acts like the motor.
  pushed.Push(0, {1.5, 0});
  for (int step = 0; step < 10; ++step) {
    pushed.Step(std::array{0.5}, result);
    driven.Step(std::array{2.0}, result);
  }
  EXPECT_LT(difference(), 1e-12);
  // A new state ends the push.
  pushed.SetState(0, start);
  driven.SetState(0, start);
  pushed.Step(std::array{2.0}, result);
  driven.Step(std::array{2.0}, result);
  EXPECT_EQ(difference(), 0);
  // A push about the second joint acts where the motor cannot.
  pushed.Push(0, {0, 1});
  pushed.Step(std::array{2.0}, result);
  driven.Step(std::array{2.0}, result);
  EXPECT_GT(pushed.state(0).w2 - driven.state(0).w2, 0.1);

  config.engine = &kClosedForm;
  EXPECT_THROW(PendulumEnv(config).Push(0, {1, 0}), Error);
}

TEST_P(PendulumEnvs, ABlowUpTerminatesWithFiniteNumbersAndStartsAgain) {
  PendulumEnv env(SmallConfig());
  StepResult result = env.MakeResult();
  env.SetState(1, {0, 0, 1e200, 0});
  env.Step(std::vector<double>{0, 0, 0}, result);
  EXPECT_EQ(result.terminated[1], 1);
  EXPECT_EQ(result.truncated[1], 0);
  EXPECT_EQ(result.terminated[0] + result.terminated[2], 0);
  for (const double reward : result.reward) EXPECT_TRUE(std::isfinite(reward));
  EXPECT_LT(std::abs(env.state(1).w1), 1);
  env.Step(std::vector<double>{0, 0, 0}, result);
  EXPECT_EQ(result.terminated[1], 0);
}

TEST_P(PendulumEnvs, ThePostsRewardAsAnExpressionHasTheSameBits) {
  // The closed form fuses the multiply-add of the squared velocities.
  const bool fused = GetParam() == &kClosedForm;
  PendulumEnvConfig config = SmallConfig();
  config.num_envs = 40;
  config.start.random_share = 1;
  PendulumEnv usual(config);
  config.reward.weight = {0, 0, 0, 0, 2};  // without effect on an expression
  config.reward.expression =
      Concat("E; h; 5*inverted; -0.01*inverted*", fused ? "fma(w1, w1, w2*w2)" : "(w1*w1 + w2*w2)",
             "; -(0.01 + 0.04*inverted)*tau*tau");
  PendulumEnv own(config);
  EXPECT_EQ(own.spec().term_names.back(), "term5");
  StepResult expected = usual.MakeResult(), result = own.MakeResult();
  Rng rng(1, "torques");
  std::vector<double> torque(40);
  int inverted = 0;
  for (int step = 0; step < 200; ++step) {
    for (double& x : torque) x = rng.Uniform(-7, 7);
    usual.Step(torque, expected);
    own.Step(torque, result);
    EXPECT_EQ(result.reward, expected.reward);
    EXPECT_EQ(result.reward_terms, expected.reward_terms);
    EXPECT_EQ(result.next_obs, expected.next_obs);
    inverted += static_cast<int>(std::ranges::count(result.at_goal, 1));
  }
  EXPECT_GT(inverted, 0);
}

TEST_P(PendulumEnvs, AnExpressionRemembersUntilTheEpisodeEnds) {
  PendulumEnvConfig config = SmallConfig();
  config.reward.expression = "dtau; pull: tau; 100*upright";
  PendulumEnv env(config), other(config);
  StepResult result = env.MakeResult();
  env.SetState(0, {std::numbers::pi, 0, 0, 0});
  env.Step(std::vector<double>{1, 1, 1}, result);
  env.SetState(1, PendulumState());
  env.Hold(2);
  env.Step(std::vector<double>{3, 3, 3}, result);
  EXPECT_EQ(result.reward_terms, (std::vector<double>{2, 3, 4, 3, 3, 0, 0, 0, 0}));
  // A set of environments that loads the state goes on alike; the held one was left as it was.
  SaveAndLoad([&](const Archive& archive) { env.State(archive); },
              [&](const Archive& archive) { other.State(archive); });
  other.Step(std::vector<double>{4, 4, 4}, result);
  EXPECT_EQ(result.reward_terms, (std::vector<double>{1, 4, 6, 1, 4, 0, 3, 4, 0}));
  env.Step(std::vector<double>{0, 0, 0}, result);
  env.SetState(0, {0, 0, 1e200, 0});
  env.Step(std::vector<double>{0, 0, 0}, result);  // blows up
  EXPECT_EQ(result.terminated[0], 1);
  EXPECT_EQ(result.reward[0], 0);
  EXPECT_EQ(result.reward_terms[2], 0);
  env.Step(std::vector<double>{2, 2, 2}, result);
  EXPECT_EQ(result.reward_terms[0], 2);
}

TEST_P(PendulumEnvs, RewardIsTheWeightedSumOfItsTermsAtTheSuccessor) {
  PendulumEnvConfig config = SmallConfig();
  config.reward.weight = {1, 0.5, 2, 3, 0};
  PendulumEnv env(config);
  StepResult result = env.MakeResult();
  env.SetState(0, {std::numbers::pi, 0, 1, 1});
  env.Step(std::vector<double>{7, 0, 0}, result);  // beyond the limit of 5
  const auto terms = RewardTerms(env.plant(0), env.state(0), 5);
  double sum = 0;
  for (size_t k = 0; k < kRewardTerms; ++k) {
    EXPECT_NEAR(result.reward_terms[k], config.reward.weight[k] * terms[k], 1e-13);
    sum += result.reward_terms[k];
  }
  EXPECT_DOUBLE_EQ(result.reward[0], sum);
  EXPECT_EQ(result.torque[0], 5);
  EXPECT_EQ(result.at_goal[0], 1);
  EXPECT_EQ(result.at_goal[1], 0);
  EXPECT_DOUBLE_EQ(result.work[0], std::abs(5 * (env.state(0).q1 - std::numbers::pi)));
}

TEST_P(PendulumEnvs, EveryEnvironmentCanHaveItsOwnPlant) {
  Plant light, heavy;
  heavy.mass2 = 2;
  heavy.length1 = 0.7;
  heavy.gravity = 5;
  heavy.damping1 = 0.05;
  heavy.torque_limit = 2;
  PendulumEnvConfig both = SmallConfig();
  both.num_envs = 2;
  both.episode_seconds = 10;
  both.plants = {light, heavy};
  PendulumEnv mixed(both);
  PendulumEnvConfig one = both;
  one.num_envs = 1;
  one.plants = {heavy};
  PendulumEnv alone(one);
  const PendulumState start{0.3, -0.2, 0.1, 0};
  mixed.SetState(1, start);
  alone.SetState(0, start);
  StepResult mixed_result = mixed.MakeResult(), alone_result = alone.MakeResult();
  for (int step = 0; step < 100; ++step) {
    const double torque = 5 * std::sin(0.1 * step);
    mixed.Step(std::vector<double>{torque, torque}, mixed_result);
    alone.Step(std::vector<double>{torque}, alone_result);
    ASSERT_EQ(mixed.state(1).q1, alone.state(0).q1);
    ASSERT_EQ(mixed.state(1).w2, alone.state(0).w2);
    ASSERT_EQ(mixed_result.reward[1], alone_result.reward[0]);
  }
  EXPECT_NE(mixed.state(0).q1, mixed.state(1).q1);
}

TEST_P(PendulumEnvs, TheNumberOfThreadsChangesNoBit) {
  PendulumEnvConfig config = SmallConfig();
  config.num_envs = 170;
  PendulumEnv one(config);
  ThreadPool pool(3);
  config.pool = &pool;
  PendulumEnv three(config);
  StepResult a = one.MakeResult(), b = three.MakeResult();
  std::vector<double> torque(170);
  for (int step = 0; step < 50; ++step) {
    for (size_t i = 0; i < torque.size(); ++i) torque[i] = std::sin(step + static_cast<double>(i));
    one.Step(torque, a);
    three.Step(torque, b);
    ASSERT_EQ(a.next_obs, b.next_obs);
    ASSERT_EQ(a.reward, b.reward);
  }
}

TEST_P(PendulumEnvs, LoadedStateContinuesWithTheSameBits) { ExpectLoadedGoesOn(SmallConfig(), 7); }

TEST_P(PendulumEnvs, StartsAreHangingWithNoiseOrAnywhere) {
  PendulumEnvConfig config = Config();
  config.num_envs = 4000;
  config.start = {0.1, 0.25, 5};
  const PendulumEnv env(config);
  int anywhere = 0;
  double square = 0;
  for (int i = 0; i < config.num_envs; ++i) {
    const PendulumState s = env.state(i);
    EXPECT_LE(std::abs(s.q1), std::numbers::pi);
    const bool far =
        std::max({std::abs(s.q1), std::abs(s.q2), std::abs(s.w1), std::abs(s.w2)}) > 0.6;
    anywhere += far ? 1 : 0;
    if (!far) square += s.w2 * s.w2;
  }
  EXPECT_NEAR(anywhere, 1000, 5 * std::sqrt(4000 * 0.25 * 0.75));
  EXPECT_NEAR(std::sqrt(square / (config.num_envs - anywhere)), 0.1, 0.01);
}

TEST_P(PendulumEnvs, ADriveBeginsWhereTheLastEpisodeEnded) {
  PendulumEnvConfig config = SmallConfig();
  config.start = {.random_share = 1, .random_drive = 0.2};
  PendulumEnv env(config), same(config);
  StepResult result = env.MakeResult();
  const std::vector<double> torque{1, -2, 3};
  for (int step = 0; step < 4; ++step) env.Step(torque, result);
  // Joint 2 of environment 0 has turned twice; in environment 1, backwards.
  env.SetState(0, {std::numbers::pi, 4 * std::numbers::pi, 0, 0});
  env.SetState(1, {std::numbers::pi, -4 * std::numbers::pi, 0, 0});
  for (int step = 0; step < 5; ++step) env.Step(torque, result);
  EXPECT_EQ(result.truncated[0] + result.truncated[1], 2);
  EXPECT_LT(env.state(0).w2, -5);
  EXPECT_GT(env.state(1).w2, 5);
  // With a seed, it begins as in a new set of environments.
  env.Restart(0, config.seed);
  EXPECT_EQ(env.state(0).w2, same.state(0).w2);
  ExpectLoadedGoesOn(config, 7);
}

TEST_P(PendulumEnvs, EpisodesWithGoalsBeginInAnotherPoseOrAnywhere) {
  PendulumEnvConfig config = Config();
  config.num_envs = 4800;
  config.any_pose = true;
  config.start = {0.05, 0.25, 5};
  const PendulumEnv env(config);
  std::array<std::array<int, 4>, 5> count{};  // starts near each pose, and anywhere, by goal
  for (int i = 0; i < config.num_envs; ++i) {
    const auto near = std::ranges::find_if(kPoses, [&](const Pose& pose) {
      const auto [lean1, lean2] = Lean(SeenFrom(pose, env.state(i)));
      return std::max({std::abs(lean1), std::abs(lean2), std::abs(env.state(i).w1),
                       std::abs(env.state(i).w2)}) < 0.35;
    });
    const auto goal = std::ranges::find(kPoses, *env.goal(i));
    ++count[static_cast<size_t>(near - kPoses.begin())][static_cast<size_t>(goal - kPoses.begin())];
  }
  for (size_t from = 0; from < 5; ++from) {
    for (size_t to = 0; to < 4; ++to) {
      const double share = from == 4 ? 0.25 / 4 : from == to ? 0 : 0.75 / 12;
      // A random start, too, may be near a pose, but hardly ever is.
      EXPECT_NEAR(count[from][to], 4800 * share, from == to ? 3 : 5 * std::sqrt(4800 * share));
    }
  }
}

TEST_P(PendulumEnvs, GoalsAreObservedAndJudged) {
  PendulumEnvConfig config = SmallConfig();
  config.num_envs = 60;
  config.episode_seconds = 1;
  config.memory = 1;
  config.any_pose = true;
  config.start = {0.1, 0.5, 5};
  config.reward.weight = {1, 0.5, 2, 3, 1};
  PendulumEnv env(config);
  // The expression of the built-in reward sees the goals, too.
  PendulumEnvConfig by_expression = config;
  by_expression.reward.expression =
      "E + 0.5*h + 10*inverted - 0.03*inverted*(w1*w1 + w2*w2) - (0.01 + 0.04*inverted)*tau*tau";
  PendulumEnv own(by_expression);
  ASSERT_EQ(env.spec().obs_size, kObservationSize + kGoalSize + kMemorySize);
  EXPECT_EQ(env.spec().mirror_signs,
            (std::vector<float>{1, -1, -1, 1, -1, -1, 1, 1, 1, 1, -1, -1, -1}));
  StepResult result = env.MakeResult(), own_result = own.MakeResult();
  std::vector<double> torque(60);
  Rng rng(3, "torques");
  std::array<int, 4> at_goal{};
  for (int step = 0; step < 200; ++step) {
    std::vector<Pose> goals;
    for (int i = 0; i < config.num_envs; ++i) goals.push_back(*env.goal(i));
    for (double& x : torque) x = rng.Uniform(-5, 5);
    env.Step(torque, result);
    own.Step(torque, own_result);
    for (int i = 0; i < config.num_envs; ++i) {
      const auto k = static_cast<size_t>(i);
      const Pose& goal = goals[k];
      const float* seen = &result.next_obs[k * static_cast<size_t>(env.spec().obs_size)];
      ASSERT_EQ(seen[kObservationSize], goal.up1 ? 1 : -1);
      ASSERT_EQ(seen[kObservationSize + 1], goal.up2 ? 1 : -1);
      ASSERT_NEAR(seen[kObservationSize + 4], torque[k] / kMemoryTorque, 1e-6);
      ASSERT_NEAR(result.reward[k], own_result.reward[k], 1e-9);
      if (result.truncated[k] != 0) continue;  // the state is that of the next episode
      const PendulumState s = env.state(i);
      const auto terms = RewardTerms(env.plant(i), s, result.torque[k], goal);
      double sum = 0;
      for (size_t term = 0; term < kRewardTerms; ++term) {
        sum += config.reward.weight[term] * terms[term];
      }
      ASSERT_NEAR(result.reward[k], sum, 1e-12);
      const bool is_there = Inverted(SeenFrom(goal, s));
      ASSERT_EQ(result.at_goal[k] != 0, is_there);
      if (is_there)
        ++at_goal[static_cast<size_t>(std::ranges::find(kPoses, goal) - kPoses.begin())];
    }
  }
  for (const int steps : at_goal) EXPECT_GT(steps, 0);
  ExpectLoadedGoesOn(config, 7);
}

TEST_P(PendulumEnvs, AFixedGoalKeepsTheStarts) {
  PendulumEnvConfig config = SmallConfig();
  config.start.random_share = 0.5;
  const PendulumEnv usual(config);
  config.any_pose = true;
  config.goal = Pose{true, false};
  const PendulumEnv env(config);
  for (int i = 0; i < config.num_envs; ++i) {
    EXPECT_EQ(env.goal(i), config.goal);
    EXPECT_EQ(env.state(i).q1, usual.state(i).q1);
    EXPECT_EQ(env.state(i).w2, usual.state(i).w2);
    std::array<double, 2> lean{};
    env.Lean(i, lean);
    const auto expected = Lean(SeenFrom(*config.goal, env.state(i)));
    EXPECT_EQ(lean, expected);
  }
}

TEST_P(PendulumEnvs, TheCurriculumsNoiseHoldsFromTheNextStartOn) {
  PendulumEnvConfig config = SmallConfig();
  config.num_envs = 500;
  PendulumEnv env(config);
  env.SetStartNoise(0);
  StepResult result = env.MakeResult();
  for (int step = 0; step < 5; ++step) env.Step(std::vector<double>(500), result);
  for (int i = 0; i < 500; ++i) ASSERT_EQ(env.state(i).q1, 0);
}

TEST(PendulumEnv, BothPhysicsAgreeFromTheSameStarts) {
  constexpr int kEnvs = 37;
  PendulumEnvConfig config;
  config.num_envs = kEnvs;
  config.episode_seconds = 1;
  config.start.random_share = 0.5;
  Rng rng(1, "plants");
  config.plants.resize(kEnvs);
  for (Plant& plant : config.plants) {
    plant.mass2 = rng.Uniform(0.5, 2);
    plant.length1 = rng.Uniform(0.3, 1);
    plant.gravity = rng.Uniform(5, 15);
  }
  PendulumEnv mujoco(config);
  config.engine = &kClosedForm;
  PendulumEnv twin(config);
  StepResult a = mujoco.MakeResult(), b = twin.MakeResult();
  std::vector<double> torque(kEnvs);
  for (int step = 0; step < 130; ++step) {  // past two resets
    for (double& x : torque) x = rng.Uniform(-6, 6);
    mujoco.Step(torque, a);
    twin.Step(torque, b);
    ASSERT_EQ(a.truncated, b.truncated);
    ASSERT_EQ(a.terminated, b.terminated);
    ASSERT_EQ(a.torque, b.torque);
    ASSERT_EQ(a.at_goal, b.at_goal);
    for (size_t i = 0; i < kEnvs; ++i) {
      ASSERT_NEAR(a.reward[i], b.reward[i], 1e-9);
      ASSERT_NEAR(a.work[i], b.work[i], 1e-9);
      ASSERT_NEAR(mujoco.state(static_cast<int>(i)).q2, twin.state(static_cast<int>(i)).q2, 1e-9);
    }
    for (size_t i = 0; i < a.next_obs.size(); ++i) {
      ASSERT_NEAR(a.next_obs[i], b.next_obs[i], 1e-6);
      ASSERT_NEAR(mujoco.obs().values()[i], twin.obs().values()[i], 1e-6);
    }
  }
}

TEST_P(PendulumEnvs, MirroredStatesAndTorquesGiveTheMirroredMotion) {
  PendulumEnvConfig config = Config();
  config.num_envs = 2;
  PendulumEnv env(config);
  const std::vector<float> signs = env.spec().mirror_signs;
  Rng rng(1, "mirror");
  const PendulumState s{1, -2, 3, 0.5};
  env.SetState(0, s);
  env.SetState(1, {-s.q1, -s.q2, -s.w1, -s.w2});
  StepResult result = env.MakeResult();
  for (int step = 0; step < 200; ++step) {
    const double torque = rng.Uniform(-5, 5);
    env.Step(std::vector<double>{torque, -torque}, result);
    ASSERT_NEAR(result.reward[0], result.reward[1], 1e-9);
    for (size_t j = 0; j < kObservationSize; ++j) {
      ASSERT_NEAR(result.next_obs[j], signs[j] * result.next_obs[kObservationSize + j], 1e-6);
    }
  }
}

}  // namespace
}  // namespace upswing
