#include "rl/sac/sac.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "base/error.h"
#include "base/testing.h"
#include "nn/network_policy.h"
#include "rl/testing.h"
#include "rl/toy_env_testing.h"

namespace upswing {
namespace {

SacConfig SmallSac() {
  SacConfig config;
  config.hidden = {16, 16};
  MakeSmall(config.off_policy);
  config.off_policy.learning_rate = config.off_policy.learning_rate_end = 3e-3;
  return config;
}

Minibatch RandomMinibatch(int size) {
  Minibatch batch(size, 1);
  Rng rng(1, "batch");
  for (size_t i = 0; i < batch.reward.size(); ++i) {
    batch.obs[i] = static_cast<float>(rng.Normal());
    batch.next_obs[i] = static_cast<float>(rng.Normal());
    batch.action[i] = static_cast<float>(rng.Uniform(-1, 1));
    batch.reward[i] = static_cast<float>(rng.Normal());
    batch.discount[i] = i % 3 == 0 ? 0.0F : 0.9F;
  }
  return batch;
}

std::vector<float> Copy(std::span<const float> values) { return {values.begin(), values.end()}; }

TEST(SoftTargets, ByHand) {
  // Use the smaller of both values minus α ln π. A discount of 0 (a termination) leaves only the
  // reward.
  const std::vector<float> q1{3, 1, 5}, q2{2, 4, 7}, log_prob{-1, 0.5F, 2};
  const std::vector<float> reward{1, 2, 3}, discount{0.9F, 0.81F, 0};
  std::vector<float> y(3);
  SoftTargets(q1, q2, log_prob, 0.5, reward, discount, y);
  EXPECT_FLOAT_EQ(y[0], 1 + 0.9F * (2 + 0.5F));
  EXPECT_FLOAT_EQ(y[1], 2 + 0.81F * (1 - 0.25F));
  EXPECT_FLOAT_EQ(y[2], 3);
}

TEST(Sac, CenteringFindsTheLevelOfValues) {
  // With a reward of 1 per step and γ = 0.9, the mean value is 10. Entropy that counts as reward
  // adds to it. Only the shift moves the values.
  const auto level = [](bool entropy_reward) {
    SacConfig config = SmallSac();
    config.off_policy.learning_rate = config.off_policy.learning_rate_end = config.tau = 0;
    config.off_policy.reward_centering = 0.05;
    config.entropy_reward = entropy_reward;
    config.twin = config.tune_alpha = false;
    config.alpha = 3;
    ThreadPool pool(1);
    Sac agent(config, ToyEnv::Spec(1), 1, pool);
    Minibatch batch = RandomMinibatch(16);
    std::ranges::fill(batch.reward, 1.0F);
    std::ranges::fill(batch.discount, 0.9F);
    for (int update = 0; update < 300; ++update) agent.Update(batch);
    agent.TakeMetrics();
    agent.Update(batch);
    return Metric(agent.TakeMetrics(), "q");
  };
  EXPECT_NEAR(level(false), 10, 1.5);
  EXPECT_GT(level(true), 15);
}

TEST(Temperature, RisesWhileEntropyIsBelowItsTarget) {
  // Entropy is -ln π. At ln π = 1.2 it is 0.2 below the target of -1; at 0.5 it is above the
  // target.
  EXPECT_LT(TemperatureGradient(1.2, -1), 0);
  EXPECT_GT(TemperatureGradient(0.5, -1), 0);
  EXPECT_EQ(TemperatureGradient(1, -1), 0);
}

TEST(Sac, TheLearnedTemperatureHoldsTheEntropyAtItsTarget) {
  SacConfig config = SmallSac();
  config.alpha_rate = 0.02;
  config.target_entropy = -0.5;
  config.actor_period = 1;
  config.off_policy.gamma = 0.5;
  ThreadPool pool(1);
  Sac agent(config, ToyEnv::Spec(4), 1, pool);
  ToyEnv env(4);
  Walk(agent, env, 1500);
  agent.TakeMetrics();
  Walk(agent, env, 200);
  EXPECT_NEAR(Metric(agent.TakeMetrics(), "entropy"), -0.5, 0.15);
}

TEST(Sac, AFixedTemperatureStays) {
  SacConfig config = SmallSac();
  config.tune_alpha = false;
  config.alpha = 0.3;
  ThreadPool pool(1);
  Sac agent(config, ToyEnv::Spec(1), 1, pool);
  for (int i = 0; i < 10; ++i) agent.Update(RandomMinibatch(16));
  EXPECT_NEAR(agent.alpha(), 0.3, 1e-6);
}

/// A bandit: observations are 0, an episode has one step, and the reward is 1 - (a - 0.4)².
class PeakBandit : public ToyEnv {
 public:
  explicit PeakBandit(int num_envs) : ToyEnv(num_envs) { SetStartNoise(0); }
  void Step(Matrix<const double> action, StepResult& r) override {
    ToyEnv::Step(action, r);
    for (size_t i = 0; i < r.reward.size(); ++i) {
      const double miss = action(static_cast<int>(i), 0) - 0.4;
      r.reward[i] = r.reward_terms[i] = 1 - miss * miss;
      r.terminated[i] = 1;
      r.truncated[i] = 0;
      SetState(static_cast<int>(i), 0);
    }
  }
};

TEST(Sac, FindsTheBestActionOfABandit) {
  for (const uint64_t seed : {1, 2, 3}) {
    SacConfig config = SmallSac();
    config.off_policy.mirror = false;
    config.actor_period = 1;
    config.tune_alpha = false;
    config.alpha = 0.01;
    ThreadPool pool(1);
    Sac agent(config, ToyEnv::Spec(4), seed, pool);
    PeakBandit env(4);
    Walk(agent, env, 1000);
    EXPECT_NEAR(ActionAt(agent, 0), 0.4, 0.1) << "seed " << seed;
  }
}

/// A reward of 1 at every step. Episodes are truncated, never terminated.
class ConstantReward : public ToyEnv {
 public:
  explicit ConstantReward(int num_envs) : ToyEnv(num_envs) { episode_steps = 3; }
  void Step(Matrix<const double> action, StepResult& r) override {
    ToyEnv::Step(action, r);
    for (size_t i = 0; i < r.reward.size(); ++i) r.reward[i] = r.reward_terms[i] = 1;
  }
};

TEST(Sac, AConstantRewardIsWorthItsSumForEver) {
  // α = 0, so Q = 1 / (1 - γ) if truncations bootstrap.
  SacConfig config = SmallSac();
  config.tune_alpha = false;
  config.alpha = 0;
  config.off_policy.gamma = 0.8;
  config.tau = 0.1;
  ThreadPool pool(1);
  Sac agent(config, ToyEnv::Spec(4), 1, pool);
  ConstantReward env(4);
  Walk(agent, env, 1500);
  agent.TakeMetrics();
  Walk(agent, env, 50);
  EXPECT_NEAR(Metric(agent.TakeMetrics(), "q"), 5, 0.1);
}

TEST(Sac, LearnsToStayNearZero) {
  for (const uint64_t seed : {1, 2, 3}) {
    SacConfig config = SmallSac();
    config.off_policy.gamma = 0.9;
    ThreadPool pool(1);
    Sac agent(config, ToyEnv::Spec(4), seed, pool);
    ToyEnv env(4, seed);
    Walk(agent, env, 2000);
    EXPECT_LT(ActionAt(agent, 2), -0.8) << seed;
    EXPECT_NEAR(ActionAt(agent, 0), 0, 0.4) << seed;
    EXPECT_GT(ActionAt(agent, -2), 0.8) << seed;
  }
}

TEST(Sac, TheActorsStepKeepsTheCritics) {
  // Two agents, one with an actor that learns, have the same critics after one update.
  SacConfig config = SmallSac();
  ThreadPool pool(1);
  config.actor_period = 1;
  Sac learns(config, ToyEnv::Spec(1), 1, pool);
  config.actor_period = 1000;
  Sac waits(config, ToyEnv::Spec(1), 1, pool);
  const std::vector<float> actor = Copy(learns.actor());
  learns.Update(RandomMinibatch(16));
  waits.Update(RandomMinibatch(16));
  for (const size_t i : {0, 1}) EXPECT_EQ(Copy(learns.critic(i)), Copy(waits.critic(i)));
  EXPECT_NE(Copy(learns.actor()), actor);
  EXPECT_EQ(Copy(waits.actor()), actor);
  EXPECT_NE(Copy(learns.critic(0)), Copy(learns.critic(1)));
}

TEST(Sac, TheExportedPolicyIsTheActorsMeanAndItsCriticsValue) {
  SacConfig config = SmallSac();
  config.policy_tau = 1;
  ThreadPool pool(1);
  EnvSpec spec = ToyEnv::Spec(1);
  spec.action_limit = {2.5};
  Sac agent(config, spec, 1, pool);
  for (int i = 0; i < 20; ++i) agent.Update(RandomMinibatch(16));
  const Network actor(config.Shape(1, 2)), critic(config.Shape(2, 1));
  auto a = actor.MakeActivations(1, false), c = critic.MakeActivations(1, false);
  const auto policy = agent.ExportPolicy({});
  for (const float x : {-300.0F, -0.7F, 0.0F, 0.2F, 1e4F}) {  // includes saturated actions
    float outputs[2], q = 0, value = 0;
    actor.Forward(agent.actor(), {&x, 1, 1}, {0, 1}, a, {outputs, 1, 2});
    const double mean = std::tanh(double{outputs[0]});
    EXPECT_NEAR(ActionAt(agent, x), 2.5 * mean, 1e-6);
    const float inputs[2]{x, static_cast<float>(mean)};
    critic.Forward(agent.critic(0), {inputs, 1, 2}, {0, 1}, c, {&q, 1, 1});
    policy->Values({&x, 1, 1}, {&value, 1, 1}, *policy->Start(1));
    EXPECT_NEAR(value, q, 1e-5 * std::max(1.0F, std::abs(q)));
  }
}

TEST(Sac, ATruncationBootstrapsFromItsOwnLastObservationAndATerminationFromNothing) {
  SacConfig config = SmallSac();
  config.off_policy.updates_per_step = 0;
  config.off_policy.learning_starts = 1000;  // uniform actions
  ThreadPool pool(1);
  Sac agent(config, ToyEnv::Spec(2), 1, pool);
  ToyEnv env(2);
  env.SetStartNoise(3);
  Walk(agent, env, 400);
  int terminated = 0;
  for (int64_t i = 0; i < agent.replay().size(); ++i) {
    const Transition t = agent.replay().at(i);
    ASSERT_NEAR(t.next_obs[0] - t.obs[0], t.action[0], 1e-5);
    const bool left = std::abs(t.next_obs[0]) > 5;
    ASSERT_EQ(t.discount, left ? 0.0F : static_cast<float>(config.off_policy.gamma));
    terminated += left ? 1 : 0;
  }
  EXPECT_EQ(agent.replay().size(), 800);
  EXPECT_GT(terminated, 0);
}

TEST(Sac, SmoothnessChargesForChangesOfTheMeanWithinAnEpisode) {
  SacConfig config = SmallSac();
  config.off_policy.updates_per_step = 0;
  config.off_policy.learning_starts = 0;
  config.policy_tau = 1;
  ThreadPool pool(1);
  std::vector<float> plain, charged;
  std::vector<float> obs;
  for (const double weight : {0.0, 2.0}) {
    config.smoothness = weight;
    Sac agent(config, ToyEnv::Spec(1), 1, pool);
    ToyEnv env(1);
    env.episode_steps = 4;
    Walk(agent, env, 12);
    auto& rewards = weight > 0 ? charged : plain;
    for (int64_t i = 0; i < 12; ++i) {
      rewards.push_back(agent.replay().at(i).reward);
      if (weight > 0) obs.push_back(agent.replay().at(i).obs[0]);
    }
  }
  Sac agent(config, ToyEnv::Spec(1), 1, pool);  // the same networks
  for (size_t i = 0; i < 12; ++i) {
    const double change = i % 4 == 0 ? 0 : ActionAt(agent, obs[i]) - ActionAt(agent, obs[i - 1]);
    EXPECT_NEAR(charged[i], plain[i] - 2 * change * change, 1e-5) << i;
  }
}

TEST(Sac, MirrorsOnlyWhereTheTaskHasSymmetry) {
  ThreadPool pool(1);
  EnvSpec spec = ToyEnv::Spec(1);
  spec.mirror_signs.clear();
  SacConfig config = SmallSac();
  EXPECT_THROW(Sac(config, spec, 1, pool), Error);
  config.off_policy.mirror = false;
  EXPECT_NO_THROW(Sac(config, spec, 1, pool));
}

TEST(Sac, TheNumberOfThreadsChangesNoBit) {
  SacConfig config = SmallSac();
  config.off_policy.batch = 128;  // four slices
  config.hidden = {130};          // three tasks
  ExpectThreadsChangeNoBit<Sac>(config, 40, 10);
}

class SacState : public ::testing::TestWithParam<bool> {};

TEST_P(SacState, LoadedStateContinuesWithTheSameBits) {
  SacConfig config = SmallSac();
  config.off_policy.n_step = 3;
  config.smoothness = 0.1;
  config.policy_tau = 0.1;
  config.twin = GetParam();
  ExpectLoadedStateGoesOn<Sac>(config, 101);
}

INSTANTIATE_TEST_SUITE_P(TwinCritics, SacState, ::testing::Bool());

TEST(Sac, NumbersThatAreNotFiniteAreFailures) {
  ExpectPoisonFails<Sac>(SmallSac());

  ThreadPool pool(1);
  Sac other(SmallSac(), ToyEnv::Spec(1), 1, pool);
  const std::vector<float> before = Copy(other.critic(0));
  Minibatch batch = RandomMinibatch(16);
  batch.reward[3] = std::numeric_limits<float>::infinity();
  EXPECT_THROW(other.Update(batch), Error);
  EXPECT_EQ(Copy(other.critic(0)), before);
}

}  // namespace
}  // namespace upswing
