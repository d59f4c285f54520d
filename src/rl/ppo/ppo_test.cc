#include "rl/ppo/ppo.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "base/error.h"
#include "base/testing.h"
#include "nn/network_policy.h"
#include "rl/testing.h"
#include "rl/toy_env_testing.h"

namespace upswing {
namespace {

PpoConfig SmallPpo(const std::string& actions = "continuous") {
  PpoConfig config;
  config.hidden = {16, 16};
  config.actions = actions;
  config.levels = 3;
  config.horizon = 16;
  config.batch = 16;
  config.reward_scale = 1;
  config.gamma = 0.9;
  config.learning_rate = config.learning_rate_end = 3e-3;
  return config;
}

/// Episodes of one step from x = 1. The reward -(a - 0.6)² is largest at 0.6.
class Bandit : public ToyEnv {
 public:
  explicit Bandit(int num_envs) : ToyEnv(num_envs), x_(static_cast<size_t>(num_envs), 1.0F) {}
  Matrix<const float> obs() const override { return {x_.data(), num_envs(), 1}; }
  void Step(Matrix<const double> action, StepResult& r) override {
    for (size_t i = 0; i < x_.size(); ++i) {
      const double a = action(static_cast<int>(i), 0);
      r.next_obs[i] = 1;
      r.reward[i] = -(a - 0.6) * (a - 0.6);
      r.terminated[i] = 1;
      r.truncated[i] = 0;
    }
  }

 private:
  std::vector<float> x_;
};

/// Stands still with a reward of 1 per step. Every tenth step truncates, or every step terminates.
class AlwaysOne : public ToyEnv {
 public:
  using ToyEnv::ToyEnv;
  void Step(Matrix<const double> action, StepResult& r) override {
    const std::vector<double> still(action.size());
    ToyEnv::Step({still.data(), action.rows(), 1}, r);
    std::ranges::fill(r.reward, 1.0);
    if (ends) std::ranges::fill(r.terminated, uint8_t{1});
  }
  bool ends = false;
};

class PpoActions : public ::testing::TestWithParam<const char*> {};
INSTANTIATE_TEST_SUITE_P(Actions, PpoActions, ::testing::Values("continuous", "levels"));

TEST_P(PpoActions, OnTheFirstMinibatchTheRatioIsOne) {
  // The only minibatch is a whole rollout, so π is still π_old. The statistics of the observations
  // change after each rollout. If old and new probabilities used different statistics, KL would not
  // be 0.
  PpoConfig config = SmallPpo(GetParam());
  config.epochs = 1;
  config.batch = config.horizon * 4;
  ThreadPool pool(1);
  Ppo agent(config, ToyEnv::Spec(4), 1, pool);
  ToyEnv env(4);
  for (int rollout = 0; rollout < 5; ++rollout) {
    Walk(agent, env, 16);
    const Metrics metrics = agent.TakeMetrics();
    EXPECT_EQ(Metric(metrics, "kl"), 0);
    EXPECT_EQ(Metric(metrics, "clip_share"), 0);
    EXPECT_NEAR(Metric(metrics, "policy_loss"), 0, 1e-6);  // mean of standardised advantages
    EXPECT_EQ(agent.updates(), rollout + 1);
    EXPECT_NE(agent.normalizer().deviation()[0], 1);
  }
  // With a second epoch, the policy moves.
  config.epochs = 2;
  Ppo other(config, ToyEnv::Spec(4), 1, pool);
  Walk(other, env, 16);
  EXPECT_GT(Metric(other.TakeMetrics(), "kl"), 0);
}

TEST_P(PpoActions, FindsTheBestActionOfABandit) {
  PpoConfig config = SmallPpo(GetParam());
  config.levels = 11;  // -1, -0.8 … 0.6 … 1
  ThreadPool pool(1);
  Ppo agent(config, ToyEnv::Spec(8), 1, pool);
  Bandit env(8);
  Walk(agent, env, 16 * 60);
  EXPECT_NEAR(ActionAt(agent, 1), 0.6, GetParam() == std::string("levels") ? 1e-9 : 0.03);
}

TEST_P(PpoActions, MirroringTeachesTheMirroredState) {
  // x = -1 never occurs. By symmetry, -0.6 is best there.
  PpoConfig config = SmallPpo(GetParam());
  config.levels = 11;
  config.mirror = true;
  ThreadPool pool(1);
  Ppo agent(config, ToyEnv::Spec(8), 1, pool);
  Bandit env(8);
  Walk(agent, env, 16 * 60);
  const double tolerance = GetParam() == std::string("levels") ? 1e-9 : 0.06;
  EXPECT_NEAR(ActionAt(agent, 1), 0.6, tolerance);
  EXPECT_NEAR(ActionAt(agent, -1), -0.6, tolerance);
}

TEST_P(PpoActions, LearnsToStayNearZero) {
  for (const uint64_t seed : {1, 2, 3}) {
    ThreadPool pool(1);
    Ppo agent(SmallPpo(GetParam()), ToyEnv::Spec(4), seed, pool);
    ToyEnv env(4, seed);
    Walk(agent, env, 3000);
    for (const float x : {-2.0F, 2.0F}) EXPECT_NEAR(ActionAt(agent, x), -x / 2, 0.25);
    EXPECT_NEAR(ActionAt(agent, 0), 0, 0.25) << "seed " << seed;
  }
}

TEST(Ppo, ATruncationHasAFutureAndATerminationHasNone) {
  // A reward of 1 per step: V = 1 / (1 - γ) = 10 if episodes are only truncated. V would differ if
  // a truncation counted as a termination, or if the value of the next start counted as the future.
  PpoConfig config = SmallPpo();
  config.kl_target = 0;
  config.learning_rate = config.learning_rate_end = 1e-2;
  config.max_gradient_norm = 100;
  ThreadPool pool(1);
  Ppo agent(config, ToyEnv::Spec(8), 1, pool);
  AlwaysOne env(8);
  Walk(agent, env, 16 * 200);
  const auto policy = agent.ExportPolicy({});
  const float x = 0.5F;
  float value = 0;
  policy->Values({&x, 1, 1}, {&value, 1, 1}, *policy->Start(1));
  EXPECT_NEAR(value, 10, 0.3);

  // Termination at each step: V is the reward of that step.
  Ppo ended(config, ToyEnv::Spec(8), 1, pool);
  env.ends = true;
  Walk(ended, env, 16 * 200);
  const auto its_policy = ended.ExportPolicy({});
  its_policy->Values({&x, 1, 1}, {&value, 1, 1}, *its_policy->Start(1));
  EXPECT_NEAR(value, 1, 0.05);
}

TEST_P(PpoActions, TheExportedPolicyIsTheAgentsMean) {
  // The exported policy is the actor's network on normalised observations, without exploration.
  PpoConfig config = SmallPpo(GetParam());
  ThreadPool pool(1);
  EnvSpec spec = ToyEnv::Spec(4);
  spec.action_limit = {3};
  Ppo agent(config, spec, 1, pool);
  ToyEnv env(4);
  Walk(agent, env, 200);
  const int outputs = config.discrete() ? 3 : 1;
  const Network network(config.Shape(1, outputs)), critic(config.Shape(1, 1));
  auto activations = network.MakeActivations(1, false),
       of_critic = critic.MakeActivations(1, false);
  const auto policy = agent.ExportPolicy({});
  const auto memory = policy->Start(1);
  Rng rng(1, "observations");
  int saturated = 0;
  for (int i = 0; i < 200; ++i) {
    const auto x = static_cast<float>(i < 100 ? 3 * rng.Normal() : 1e4 * rng.Normal());
    float normal = 0, v = 0, value = 0;
    agent.normalizer().Apply({&x, 1}, {&normal, 1});
    std::vector<float> y(static_cast<size_t>(outputs));
    network.Forward(agent.actor(), {&normal, 1, 1}, {0, 1}, activations, {y.data(), 1, outputs});
    critic.Forward(agent.critic(), {&normal, 1, 1}, {0, 1}, of_critic, {&v, 1, 1});
    double action = 9;
    policy->Act({&x, 1, 1}, {&action, 1, 1}, *memory);
    policy->Values({&x, 1, 1}, {&value, 1, 1}, *memory);
    if (config.discrete()) {
      const auto best = std::ranges::max_element(y) - y.begin();
      EXPECT_EQ(action, 3.0 * static_cast<double>(best - 1));
    } else {
      EXPECT_NEAR(action, 3 * std::clamp(y[0], -1.0F, 1.0F), 1e-5);
      saturated += std::abs(y[0]) > 1 ? 1 : 0;
    }
    EXPECT_NEAR(value, v, 1e-4);
  }
  EXPECT_EQ(saturated > 0, !config.discrete());
}

TEST(Ppo, TheEnvironmentGetsTheClippedActionAndTheBufferTheRawOne) {
  // With σ = 5, most actions exceed the limit. If the buffer stored clipped actions, their
  // probability would differ from that of the drawn actions, and KL on the first minibatch would
  // not be 0.
  PpoConfig config = SmallPpo();
  config.initial_std = 5;
  config.epochs = 1;
  config.batch = 16 * 4;
  ThreadPool pool(1);
  Ppo agent(config, ToyEnv::Spec(4), 1, pool);
  ToyEnv env(4);
  StepResult result(env.spec());
  std::vector<double> torques(4);
  int clipped = 0;
  for (int i = 0; i < 16; ++i) {
    agent.Act(env.obs(), {torques.data(), 4, 1});
    for (const double u : torques) {
      EXPECT_LE(std::abs(u), 1);
      clipped += std::abs(u) == 1 ? 1 : 0;
    }
    env.Step({torques.data(), 4, 1}, result);
    agent.Observe(result);
    agent.Learn();
  }
  EXPECT_GT(clipped, 40);  // 64 actions; P(|u| > 1) = 0.84
  EXPECT_EQ(Metric(agent.TakeMetrics(), "kl"), 0);
}

TEST(Ppo, MetricsAreThoseOfTheLastRolloutUntilThereIsAnother) {
  PpoConfig config = SmallPpo();
  ThreadPool pool(1);
  Ppo agent(config, ToyEnv::Spec(4), 1, pool);
  ToyEnv env(4);
  Walk(agent, env, 16);
  const Metrics first = agent.TakeMetrics();
  EXPECT_GT(Metric(first, "value_loss"), 0);
  Walk(agent, env, 8);  // half a rollout
  EXPECT_EQ(Metric(agent.TakeMetrics(), "value_loss"), Metric(first, "value_loss"));
  Walk(agent, env, 8);
  EXPECT_NE(Metric(agent.TakeMetrics(), "value_loss"), Metric(first, "value_loss"));
}

TEST(Ppo, TheLearningRateFollowsTheKlTarget) {
  for (const bool large : {false, true}) {
    PpoConfig config = SmallPpo();
    config.kl_target = large ? 1e9 : 1e-9;
    ThreadPool pool(1);
    Ppo agent(config, ToyEnv::Spec(4), 1, pool);
    ToyEnv env(4);
    Walk(agent, env, 16);
    EXPECT_NEAR(agent.learning_rate(), large ? 3e-3 * 1.5 : 3e-3 / 1.5, 1e-12);
  }
}

TEST(Ppo, TheEntropyBonusRaisesTheDeviationToItsBoundAndEndsWithTheSchedule) {
  PpoConfig config = SmallPpo();
  config.kl_target = 0;
  config.learning_rate = config.learning_rate_end = 1e-2;
  config.entropy_bonus = 10;
  config.initial_std = 0.4;
  config.max_std = 0.5;
  config.learning_rate_steps = 8 * 16 * 40;
  ThreadPool pool(1);
  Ppo agent(config, ToyEnv::Spec(8), 1, pool);
  Bandit env(8);
  Walk(agent, env, 16 * 10);
  EXPECT_NEAR(Metric(agent.TakeMetrics(), "std"), 0.5, 1e-6);
  // 100 rollouts without a bonus: exploration around the best action shrinks
  Walk(agent, env, 16 * 130);
  EXPECT_LT(Metric(agent.TakeMetrics(), "std"), 0.2);
}

TEST_P(PpoActions, TheNumberOfThreadsChangesNoBit) {
  PpoConfig config = SmallPpo(GetParam());
  config.hidden = {130, 70};  // several tasks per layer, three chunks of Adam
  config.batch = 128;
  config.mirror = true;
  ExpectThreadsChangeNoBit<Ppo>(config, 80, 40);  // three blocks of environments
}

TEST_P(PpoActions, LoadedStateContinuesWithTheSameBits) {
  PpoConfig config = SmallPpo(GetParam());
  config.mirror = true;
  config.value_clip = 0.2;
  // between two rollouts, and within one
  for (const int steps : {32, 41}) ExpectLoadedStateGoesOn<Ppo>(config, steps);
}

TEST(Ppo, AStateThatIsNoneIsRefused) {
  const PpoConfig config = SmallPpo("levels");
  ThreadPool pool(1);
  Ppo agent(config, ToyEnv::Spec(2), 1, pool);
  ToyEnv env(2);
  Walk(agent, env, 20);
  const auto refused = [&](const auto& change) {
    Tensors tensors;
    agent.State(Archive::Saver(tensors));
    const std::vector<std::byte> bytes = WriteSafetensors(tensors).Joined();
    Tensors copy = ReadSafetensors(bytes, "saved");
    change(copy);
    Ppo other(config, ToyEnv::Spec(2), 1, pool);
    EXPECT_THROW(other.State(Archive::Loader(copy)), Error);
  };
  // Expected 40: 32 and 8 that wait.
  refused([](Tensors& t) { t.AddScalar<int64_t>("steps", 38); });
  refused([](Tensors& t) { t.AddScalar<int64_t>("updates", 7); });  // expected 8
  refused([](Tensors& t) { t.AddScalar<int64_t>("rollout/filled", 16); });
  refused([](Tensors& t) {
    t.AddCopy<float>("rollout/action", std::vector<float>{0, 1, 2, 0, 1, 2, 0, 0.5F});
  });
  refused([](Tensors& t) {
    t.AddCopy<float>("rollout/action", std::vector<float>{0, 1, 2, 0, 1, 2, 0, 3});
  });
  refused([](Tensors& t) { t.AddCopy<int64_t>("order", std::vector<int64_t>(32)); });
}

TEST(Ppo, SettingsThatDoNotFitAreRefused) {
  ThreadPool pool(1);
  PpoConfig config = SmallPpo();
  config.batch = 24;  // does not divide 16 × 4 = 64
  try {
    config.Check(4);
    FAIL();
  } catch (const Error& error) {
    EXPECT_STREQ(error.what(),
                 "batch: expected a size that divides the 64 steps of a rollout (horizon 16, 4 "
                 "environments), such as 16 or 32, got 24");
  }
  config.batch = 100;
  try {
    config.Check(4);
    FAIL();
  } catch (const Error& error) {
    EXPECT_NE(std::string(error.what()).find("such as 64, got 100"), std::string::npos);
  }
  config = SmallPpo();
  config.mirror = true;
  EnvSpec spec = ToyEnv::Spec(1);
  spec.mirror_signs.clear();
  EXPECT_THROW(Ppo(config, spec, 1, pool), Error);
  config = SmallPpo("levels");
  spec.action_limit = {1, 1};
  EXPECT_THROW(Ppo(config, spec, 1, pool), Error);
  EXPECT_NO_THROW(Ppo(SmallPpo(), spec, 1, pool));
}

TEST(Ppo, NumbersThatAreNotFiniteAreFailures) { ExpectPoisonFails<Ppo>(SmallPpo()); }

}  // namespace
}  // namespace upswing
