#include "rl/dqn/dqn.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "base/argmax.h"
#include "base/error.h"
#include "base/testing.h"
#include "nn/network_policy.h"
#include "rl/replay/mirror.h"
#include "rl/testing.h"
#include "rl/torque_levels.h"
#include "rl/toy_env_testing.h"

namespace upswing {
namespace {

DqnConfig SmallDqn() {
  DqnConfig config;
  config.hidden = {16, 16};
  config.head = 8;
  MakeSmall(config.off_policy);
  config.levels = 3;
  return config;
}

const std::vector<double> kTorques{-1, 0, 1};

Minibatch RandomBatch(int size) {
  Minibatch batch(size, 1);
  Rng rng(1, "batch");
  for (size_t i = 0; i < batch.action.size(); ++i) {
    batch.obs[i] = static_cast<float>(rng.Normal());
    batch.next_obs[i] = static_cast<float>(rng.Normal());
    batch.action[i] = static_cast<float>(rng.Below(3));
    batch.reward[i] = static_cast<float>(rng.Normal());
    batch.discount[i] = i % 3 == 0 ? 0.0F : 0.9F;
  }
  return batch;
}

TEST(TdTargets, VanillaAndDoubleByHand) {
  const std::vector<float> online{1, 5, 2, /**/ 4, 0, 3};
  const std::vector<float> target{7, 2, 6, /**/ 1, 9, 8};
  const Matrix<const float> Q(online.data(), 2, 3), Q_target(target.data(), 2, 3);
  const std::vector<float> reward{0.5F, -1}, discount{0.9F, 0.81F};
  std::vector<float> y(2);
  TdTargets(Q_target, Q_target, reward, discount, y);  // largest target values: 7 and 9
  EXPECT_FLOAT_EQ(y[0], 0.5F + 0.9F * 7);
  EXPECT_FLOAT_EQ(y[1], -1 + 0.81F * 9);
  TdTargets(Q, Q_target, reward, discount, y);  // target values at the online argmax: 2 and 1
  EXPECT_FLOAT_EQ(y[0], 0.5F + 0.9F * 2);
  EXPECT_FLOAT_EQ(y[1], -1 + 0.81F * 1);
  TdTargets(Q, Q_target, reward, std::vector<float>{0, 0}, y);  // terminated: only the reward
  EXPECT_EQ(y, reward);
}

TEST(Huber, TheGradientIsClippedAndBelongsToTheLoss) {
  for (const float delta : {-3.0F, -1.0F, -0.2F, 0.0F, 0.7F, 1.0F, 12.0F}) {
    const double h = 1e-3;
    const double numeric =
        (HuberLoss(delta + static_cast<float>(h)) - HuberLoss(delta - static_cast<float>(h))) /
        (2 * h);
    EXPECT_NEAR(HuberGradient(delta), numeric, 1e-3);
    EXPECT_LE(std::abs(HuberGradient(delta)), 1);
  }
}

TEST(Torques, AreTheChoicesOfATaskThatHasThem) {
  EnvSpec spec = ToyEnv::Spec(1);
  spec.action_limit = {4};
  EXPECT_EQ(ActionTable(spec, 3, "dqn"), (std::vector<double>{-4, 0, 4}));
  spec.choices = {3, 4};
  EXPECT_EQ(ActionTable(spec, 3, "dqn"), spec.choices);
  // The agent's networks have an output for each choice.
  DqnConfig config;
  config.off_policy.mirror = false;
  ThreadPool pool(1);
  const auto policy = Dqn(config, spec, 1, pool).ExportPolicy({});
  EXPECT_EQ(policy->num_values(), 2);
  EXPECT_EQ(policy->value_actions()(1, 0), 4);
}

TEST(Torques, AreEvenlySpacedFromLimitToLimit) {
  EXPECT_EQ(TorqueLevels(5, 9),
            (std::vector<double>{-5, -3.75, -2.5, -1.25, 0, 1.25, 2.5, 3.75, 5}));
}

/// Loss of a minibatch by the papers' formulas, in plain code with the agent's parameters.
double LossByHand(const DqnConfig& config, std::span<const float> online,
                  std::span<const float> target, const Minibatch& batch) {
  const Network network(config.Shape(1, 3));
  auto activations = network.MakeActivations(1, false);
  const auto q = [&](std::span<const float> parameters, const float& x) {
    std::vector<float> values(3);
    network.Forward(parameters, Matrix<const float>(&x, 1, 1), {0, 1}, activations,
                    Matrix<float>(values.data(), 1, 3));
    return values;
  };
  double loss = 0;
  for (size_t i = 0; i < batch.action.size(); ++i) {
    const auto chosen = ArgMax(q(config.double_q ? online : target, batch.next_obs[i]));
    // The mirror image has the opposite observation, and its torques are in reverse order.
    const double next = config.off_policy.mirror
                            ? q(target, -batch.next_obs[i])[static_cast<size_t>(2 - chosen)]
                            : q(target, batch.next_obs[i])[static_cast<size_t>(chosen)];
    const double y = batch.reward[i] + batch.discount[i] * next;
    const double delta = q(online, batch.obs[i])[static_cast<size_t>(batch.action[i])] - y;
    loss += std::abs(delta) <= 1 ? delta * delta / 2 : std::abs(delta) - 0.5;
  }
  return loss / static_cast<double>(batch.action.size());
}

class DqnVariants : public ::testing::TestWithParam<std::tuple<bool, bool, bool>> {};

TEST_P(DqnVariants, LossIsThatOfThePapersAndFalls) {
  DqnConfig config = SmallDqn();
  std::tie(config.double_q, config.dueling, config.off_policy.mirror) = GetParam();
  config.off_policy.learning_rate = config.off_policy.learning_rate_end = 1e-2;
  ThreadPool pool(1);
  Dqn agent(config, ToyEnv::Spec(1), 1, pool);
  const Minibatch batch = RandomBatch(16);
  const double first = LossByHand(config, agent.online(), agent.target(), batch);
  // After the first update, the online and target parameters differ.
  for (int update = 0; update < 60; ++update) {
    agent.TakeMetrics();
    const double expected = LossByHand(config, agent.online(), agent.target(), batch);
    agent.Update(batch);
    ASSERT_NEAR(Metric(agent.TakeMetrics(), "loss"), expected, 1e-5);
  }
  EXPECT_LT(LossByHand(config, agent.online(), agent.target(), batch), first / 2);
}

INSTANTIATE_TEST_SUITE_P(Flags, DqnVariants,
                         ::testing::Combine(::testing::Bool(), ::testing::Bool(),
                                            ::testing::Bool()));

TEST(Dqn, CenteringShiftsAllValuesByAShareOfTheMeanError) {
  DqnConfig config = SmallDqn();
  config.off_policy.learning_rate = config.off_policy.learning_rate_end =
      0;  // only the shift changes values
  config.tau = 0;
  config.off_policy.reward_centering = 0.5;
  config.off_policy.mirror = false;
  for (const bool dueling : {false, true}) {
    config.dueling = dueling;
    ThreadPool pool(1);
    Dqn agent(config, ToyEnv::Spec(1), 1, pool);
    const Minibatch batch = RandomBatch(16);
    const Network network(config.Shape(1, 3));
    auto activations = network.MakeActivations(16, false);
    const auto values = [&](std::span<const float> parameters, std::span<const float> obs) {
      std::vector<float> q(48);
      network.Forward(parameters, {obs.data(), 16, 1}, {0, 16}, activations, {q.data(), 16, 3});
      return q;
    };
    const std::vector<float> q = values(agent.online(), batch.obs);
    const std::vector<float> next = values(agent.online(), batch.next_obs);
    double errors = 0, per_shift = 0;
    for (size_t i = 0; i < 16; ++i) {
      const float best = *std::max_element(&next[3 * i], &next[3 * i] + 3);
      const double y = batch.reward[i] + batch.discount[i] * best;
      errors += std::clamp(q[3 * i + static_cast<size_t>(batch.action[i])] - y, -1.0, 1.0);
      per_shift += 1 - batch.discount[i];
    }
    agent.Update(batch);
    const double shift = -0.5 * errors / per_shift;
    EXPECT_GT(std::abs(shift), 1e-3);
    const std::vector<float> online = values(agent.online(), batch.obs);
    const std::vector<float> target = values(agent.target(), batch.obs);
    for (size_t i = 0; i < 48; ++i) {
      EXPECT_NEAR(online[i], q[i] + shift, 1e-5);
      EXPECT_NEAR(target[i], q[i] + shift, 1e-5);
    }
  }
}

TEST(Dqn, WeightsMultiplyTheGradientOfTheirTransition) {
  // A transition of weight 1/2, twice, equals one of weight 1. A transition of weight 0 changes
  // nothing.
  DqnConfig config = SmallDqn();
  config.off_policy.batch = 4;
  config.off_policy.max_gradient_norm = 1e9;
  ThreadPool pool(1);
  Minibatch whole = RandomBatch(4), parts = RandomBatch(4);
  whole.weight = {1, 0, 1, 0};
  parts.weight = {0.5F, 0.5F, 0.5F, 0.5F};
  for (const size_t copy : {1, 3}) {
    parts.obs[copy] = parts.obs[copy - 1];
    parts.next_obs[copy] = parts.next_obs[copy - 1];
    parts.action[copy] = parts.action[copy - 1];
    parts.reward[copy] = parts.reward[copy - 1];
    parts.discount[copy] = parts.discount[copy - 1];
  }
  Dqn a(config, ToyEnv::Spec(1), 1, pool), b(config, ToyEnv::Spec(1), 1, pool);
  a.Update(whole);
  b.Update(parts);
  const Metrics of_a = a.TakeMetrics(), of_b = b.TakeMetrics();
  EXPECT_NEAR(Metric(of_a, "loss"), Metric(of_b, "loss"), 1e-6);
  EXPECT_NEAR(Metric(of_a, "gradient_norm"), Metric(of_b, "gradient_norm"), 1e-5);
}

TEST(Dqn, MirroringNegatesTorquesAndSomeObservations) {
  const Minibatch before = RandomBatch(64);
  Minibatch batch = before;
  Rng rng(1, "mirror");
  MirrorHalf(rng, std::vector<float>{-1}, ActionSpace::Discrete(3), batch);
  int mirrored = 0;
  for (size_t i = 0; i < 64; ++i) {
    const bool turned = batch.obs[i] != before.obs[i];
    mirrored += turned ? 1 : 0;
    EXPECT_EQ(batch.obs[i], turned ? -before.obs[i] : before.obs[i]);
    EXPECT_EQ(batch.next_obs[i], turned ? -before.next_obs[i] : before.next_obs[i]);
    EXPECT_EQ(kTorques.at(static_cast<size_t>(batch.action[i])),
              (turned ? -1 : 1) * kTorques.at(static_cast<size_t>(before.action[i])));
  }
  EXPECT_GT(mirrored, 16);
  EXPECT_LT(mirrored, 48);

  DqnConfig config = SmallDqn();
  config.off_policy.mirror = true;
  ThreadPool pool(1);
  EnvSpec spec = ToyEnv::Spec(1);
  spec.mirror_signs.clear();
  EXPECT_THROW(Dqn(config, spec, 1, pool), Error);
  config.off_policy.mirror = false;
  EXPECT_NO_THROW(Dqn(config, spec, 1, pool));
  spec.action_limit = {1, 1};
  EXPECT_THROW(Dqn(config, spec, 1, pool), Error);
}

TEST(Dqn, TheExportedPolicyIsAnAverageOfTheLearnedOnes) {
  DqnConfig config = SmallDqn();
  config.policy_tau = 0.25;
  ThreadPool pool(1);
  Dqn agent(config, ToyEnv::Spec(1), 1, pool);
  // The average begins with the first parameters.
  std::vector<float> average(agent.online().begin(), agent.online().end());
  for (int update = 0; update < 3; ++update) {
    agent.Update(RandomBatch(16));
    for (size_t i = 0; i < average.size(); ++i) {
      average[i] += 0.25F * (agent.online()[i] - average[i]);
    }
  }
  const Network network(config.Shape(1, 3));
  auto activations = network.MakeActivations(1, false);
  const float x = 0.7F;
  std::vector<float> expected(3), got(3);
  network.Forward(average, {&x, 1, 1}, {0, 1}, activations, {expected.data(), 1, 3});
  const auto policy = agent.ExportPolicy({});
  policy->Values({&x, 1, 1}, {got.data(), 1, 3}, *policy->Start(1));
  for (size_t a = 0; a < 3; ++a) EXPECT_NEAR(got[a], expected[a], 1e-5);
}

TEST(Dqn, TheAverageGrowsLongerAsTheLearningRateFalls) {
  DqnConfig config = SmallDqn();
  config.policy_tau = 0.5;
  config.off_policy.learning_rate = 1e-2;
  config.off_policy.learning_rate_end = 1e-3;
  config.off_policy.learning_rate_steps = 100;
  config.off_policy.updates_per_step = 0;
  config.off_policy.importance_exponent = 0.4;
  ThreadPool pool(1);
  Dqn agent(config, ToyEnv::Spec(1), 1, pool);
  ToyEnv env(1);
  Walk(agent, env, 200);
  EXPECT_DOUBLE_EQ(agent.learning_rate(), 1e-3);
  EXPECT_DOUBLE_EQ(agent.importance_exponent(), 1);
  // At a tenth of the learning rate, the average moves a tenth as fast: by 0.05 of the difference.
  const std::vector<float> first(agent.online().begin(), agent.online().end());
  agent.Update(RandomBatch(16));
  std::vector<float> average(first);
  for (size_t i = 0; i < average.size(); ++i) average[i] += 0.05F * (agent.online()[i] - first[i]);
  const Network network(config.Shape(1, 3));
  auto activations = network.MakeActivations(1, false);
  const float x = 0.7F;
  std::vector<float> expected(3), got(3), fast(3);
  network.Forward(average, {&x, 1, 1}, {0, 1}, activations, {expected.data(), 1, 3});
  network.Forward(agent.online(), {&x, 1, 1}, {0, 1}, activations, {fast.data(), 1, 3});
  const auto policy = agent.ExportPolicy({});
  policy->Values({&x, 1, 1}, {got.data(), 1, 3}, *policy->Start(1));
  for (size_t a = 0; a < 3; ++a) EXPECT_NEAR(got[a], expected[a], 1e-5);
  EXPECT_GT(std::abs(fast[0] - got[0]), 1e-4);
}

TEST(Dqn, TargetFollowsByPolyakAveragingAtEachUpdate) {
  DqnConfig config = SmallDqn();
  config.tau = 0.25;
  ThreadPool pool(1);
  Dqn agent(config, ToyEnv::Spec(1), 1, pool);
  const std::vector<float> before(agent.target().begin(), agent.target().end());
  agent.Update(RandomBatch(16));
  for (size_t i = 0; i < before.size(); ++i) {
    EXPECT_NEAR(agent.target()[i], 0.75F * before[i] + 0.25F * agent.online()[i], 1e-6);
  }
}

TEST(Dqn, TargetCanBeCopiedPeriodically) {
  DqnConfig config = SmallDqn();
  config.target_period = 3;
  ThreadPool pool(1);
  Dqn agent(config, ToyEnv::Spec(1), 1, pool);
  const std::vector<float> first(agent.target().begin(), agent.target().end());
  for (int update = 1; update <= 3; ++update) {
    agent.Update(RandomBatch(16));
    EXPECT_EQ(std::ranges::equal(agent.target(), first), update < 3);
  }
  EXPECT_TRUE(std::ranges::equal(agent.target(), agent.online()));
}

TEST(Dqn, ATruncationBootstrapsFromItsOwnLastObservationAndATerminationFromNothing) {
  // Tests the whole path: environment → agent → memory. Outward steps leave ±5; ten steps truncate
  // an episode. Starts are near 0, so an observation after a reset would be visible.
  DqnConfig config = SmallDqn();
  config.off_policy.updates_per_step = 0;
  ThreadPool pool(1);
  Dqn agent(config, ToyEnv::Spec(2), 1, pool);
  ToyEnv env(2);
  Walk(agent, env, 400);
  int terminated = 0;
  for (int64_t i = 0; i < agent.replay().size(); ++i) {
    const Transition t = agent.replay().at(i);
    const float moved = t.next_obs[0] - t.obs[0];
    ASSERT_NEAR(moved, kTorques[static_cast<size_t>(t.action[0])], 1e-5);
    const bool left = std::abs(t.next_obs[0]) > 5;
    ASSERT_EQ(t.discount, left ? 0.0F : static_cast<float>(config.off_policy.gamma));
    terminated += left ? 1 : 0;
  }
  EXPECT_EQ(agent.replay().size(), 800);
  EXPECT_GT(terminated, 0);
}

TEST(Dqn, UpdatesFollowTheStepsForAnyNumberOfEnvironments) {
  for (const int envs : {1, 4}) {
    ThreadPool pool(1);
    Dqn agent(SmallDqn(), ToyEnv::Spec(envs), 1, pool);
    ToyEnv env(envs);
    Walk(agent, env, 400 / envs);
    EXPECT_EQ(agent.updates(), (400 - 32) / 2);
  }
}

TEST(Dqn, EpsilonDecaysWithEachEpisodeToItsEnd) {
  DqnConfig config = SmallDqn();
  config.epsilon_decay = 0.5;
  config.epsilon_end = 0.2;
  ThreadPool pool(1);
  Dqn agent(config, ToyEnv::Spec(1), 1, pool);
  ToyEnv env(1);
  env.episode_steps = 4;
  EXPECT_EQ(agent.epsilon(), 1);
  Walk(agent, env, 4);
  EXPECT_EQ(agent.epsilon(), 0.5);
  Walk(agent, env, 4);
  EXPECT_EQ(agent.epsilon(), 0.25);
  Walk(agent, env, 4);
  EXPECT_EQ(agent.epsilon(), 0.2);
}

TEST(Dqn, LearnsToStayNearZero) {
  for (const uint64_t seed : {1, 2, 3}) {
    ThreadPool pool(1);
    Dqn agent(SmallDqn(), ToyEnv::Spec(4), seed, pool);
    ToyEnv env(4, seed);
    Walk(agent, env, 1500);
    for (const float x : {-2.0F, 0.0F, 2.0F}) {
      EXPECT_EQ(ActionAt(agent, x), x == 0 ? 0 : -x / 2) << "seed " << seed << ", x = " << x;
    }
  }
}

TEST(Dqn, TheExampleOfTheFirstUpdateMovesTheGuessToTheTarget) {
  DqnConfig config = SmallDqn();
  config.off_policy.batch = 1;  // so that no other transition moves the guess
  ThreadPool pool(1);
  for (const uint64_t seed : {1, 2, 3, 4, 5}) {
    Dqn agent(config, ToyEnv::Spec(1), seed, pool);
    ToyEnv env(1, seed);
    while (agent.updates() == 0) {
      EXPECT_FALSE(agent.LastUpdate().has_value());
      Walk(agent, env, 1);
    }
    const UpdateExample example = agent.LastUpdate().value();
    EXPECT_GT((example.corrected - example.guess) * (example.target - example.guess), 0);
    EXPECT_NE(std::ranges::find(kTorques, example.torque), kTorques.end());
    EXPECT_EQ(example.epsilon, agent.epsilon());
    EXPECT_EQ(example.remembered, agent.replay().size());
    EXPECT_EQ(example.capacity, 1000);
  }
}

TEST(Dqn, TheNumberOfThreadsChangesNoBit) {
  DqnConfig config = SmallDqn();
  config.off_policy.batch = 128;  // four slices
  // Layers of 130 and 70 inputs have five tasks. Their 19,000 parameters make three chunks of Adam.
  config.hidden = {130};
  config.head = 70;
  ExpectThreadsChangeNoBit<Dqn>(config, 4, 100);
}

TEST(Dqn, LoadedStateContinuesWithTheSameBits) {
  DqnConfig config = SmallDqn();
  config.off_policy.n_step = 3;
  config.off_policy.prioritized = config.off_policy.mirror = true;
  config.policy_tau = 0.1;
  ExpectLoadedStateGoesOn<Dqn>(config, 101);
}

TEST(Dqn, NumbersThatAreNotFiniteAreFailures) {
  ExpectPoisonFails<Dqn>(SmallDqn());

  ThreadPool pool(1);
  Dqn other(SmallDqn(), ToyEnv::Spec(1), 1, pool);
  const std::vector<float> before(other.online().begin(), other.online().end());
  Minibatch batch = RandomBatch(16);
  batch.reward[3] = std::numeric_limits<float>::infinity();
  EXPECT_THROW(other.Update(batch), Error);
  EXPECT_TRUE(std::ranges::equal(other.online(), before));
}

}  // namespace
}  // namespace upswing
