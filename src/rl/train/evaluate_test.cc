#include "rl/train/evaluate.h"

#include <gtest/gtest.h>

#include <numbers>

#include "nn/network_policy.h"
#include "rl/toy_env_testing.h"

namespace upswing {
namespace {

/// Parts of a policy that observes one number and always chooses the same torque.
NetworkPolicyParts ConstantParts(double torque) {
  NetworkPolicyParts parts{ActionRule::kLevels, {1, {1}, 1}};
  parts.parameters.resize(Network(parts.shape).num_parameters());
  parts.torques = {torque};
  return parts;
}
NetworkPolicy Constant(double torque) { return {ConstantParts(torque), {}}; }

/// Environment i is at the goal from its state goal_from[i] on, except in a gap.
class ScriptedEnv : public ToyEnv {
 public:
  explicit ScriptedEnv(std::vector<int> goal_from, int gap = -1)
      : ToyEnv(static_cast<int>(goal_from.size())), goal_from_(std::move(goal_from)), gap_(gap) {
    spec_.step_seconds = 0.02;
  }
  void Step(Matrix<const double> action, StepResult& r) override {
    const std::span<const double> torque = action.values();
    ++k_;
    for (size_t i = 0; i < goal_from_.size(); ++i) {
      r.at_goal[i] = k_ >= goal_from_[i] && k_ != gap_ ? 1 : 0;
      r.reward[i] = r.reward_terms[i] = k_;
      r.torque[i] = torque[i];
      r.work[i] = 0.5;
      r.terminated[i] = static_cast<int>(i) == blow_up && k_ == 900 ? 1 : 0;
      r.truncated[i] = 0;
      r.next_obs[i] = static_cast<float>(torque[i]);
    }
  }
  int blow_up = -1;

 private:
  std::vector<int> goal_from_;
  int gap_;
  int k_ = 0;
};

TEST(Evaluate, SuccessNeedsAllOfTheLastTenSeconds) {
  // State 500 is at t = 10 s. At the goal from there on is a success; from the next state on is
  // not.
  ScriptedEnv env({500, 501, 100, 2000});
  const Evaluation e = Evaluate(Constant(-2), env);
  EXPECT_EQ(e.episodes, 4);
  EXPECT_EQ(e.successes, 2);
  EXPECT_DOUBLE_EQ(e.swing_up_seconds.median, (10 + 2) / 2.0);
  EXPECT_DOUBLE_EQ(e.reward_sum.mean, 500 * 501 / 2.0);  // the first 500 rewards: 1 + … + 500
  EXPECT_DOUBLE_EQ(e.term_means[0], e.reward_sum.mean);
  EXPECT_DOUBLE_EQ(e.work.mean, 500);  // 1000 steps of half a joule
  EXPECT_EQ(e.peak_torque, 2);
  EXPECT_DOUBLE_EQ(e.rms_torque.mean, 2);
}

/// Metadata of a policy whose Q-values estimate the sum of gamma^k · reward_scale · r.
PolicyInfo Units(double gamma, double reward_scale) {
  PolicyInfo info;
  info.gamma = gamma;
  info.reward_scale = reward_scale;
  return info;
}

TEST(Evaluate, ReportsTheValueAndTheReturnThatItEstimates) {
  NetworkPolicyParts parts = ConstantParts(1);
  parts.parameters.back() = 3;  // bias of the output: Q = 3 everywhere
  const NetworkPolicy policy(parts, Units(0.5, 2));
  ScriptedEnv env({500, 501});
  const Evaluation e = Evaluate(policy, env);
  EXPECT_DOUBLE_EQ(e.value, 1.5);
  EXPECT_NEAR(e.discounted_return, 4, 1e-12);  // Σ k γᵏ⁻¹ = 1 / (1 - γ)²

  const Evaluation silent = Evaluate(Constant(0), env);
  EXPECT_EQ(silent.value, 0);
  EXPECT_EQ(silent.discounted_return, 0);
}

TEST(Evaluate, OneStateOffTheGoalEndsAStretch) {
  ScriptedEnv early({100}, 499), late({100}, 501);
  EXPECT_EQ(Evaluate(Constant(0), early).successes, 1);
  EXPECT_EQ(Evaluate(Constant(0), late).successes, 0);
}

TEST(Evaluate, ABlownUpEpisodeFailsEvenIfLaterStatesAreAtTheGoal) {
  ScriptedEnv env({100, 100});
  env.blow_up = 1;
  const std::vector<EvaluationEpisode> episodes = EvaluateEpisodes(Constant(0), env);
  EXPECT_DOUBLE_EQ(episodes[1].seconds, 18);
  EXPECT_DOUBLE_EQ(episodes[1].work, 450);  // 900 steps of half a joule
  EXPECT_FALSE(episodes[1].swing_up_seconds);
  EXPECT_FALSE(episodes[0].diverged);
  EXPECT_TRUE(episodes[1].diverged);
  const Evaluation e = Summarize(episodes, env.spec().evaluation);
  EXPECT_EQ(e.successes, 1);
  EXPECT_EQ(e.diverged, 1);
  EXPECT_DOUBLE_EQ(e.seconds.mean, 19);
}

TEST(Evaluate, ATimeLimitBeforeTheEndOfTheTimeEndsAnEpisode) {
  // A toy episode has 10 steps, the rule 20. The walk stays where it begins.
  ToyEnv env(3);
  for (int i = 0; i < 3; ++i) env.SetState(i, 0);
  for (const EvaluationEpisode& episode : EvaluateEpisodes(Constant(0), env)) {
    EXPECT_EQ(episode.seconds, 10);
    EXPECT_EQ(episode.reward_sum, 10);
  }
}

TEST(Evaluate, TheVeryLastStateAtTheGoalIsAnEndAtTheGoal) {
  ScriptedEnv env({1000, 1001});
  const std::vector<EvaluationEpisode> episodes = EvaluateEpisodes(Constant(0), env);
  EXPECT_FALSE(episodes[0].success);
  EXPECT_DOUBLE_EQ(episodes[0].swing_up_seconds.value(), 20);
  EXPECT_FALSE(episodes[1].swing_up_seconds);
}

TEST(Evaluate, TheSummaryIsThatOfTheEpisodes) {
  ScriptedEnv env({500, 501, 100, 2000}), again({500, 501, 100, 2000});
  const std::vector<EvaluationEpisode> episodes = EvaluateEpisodes(Constant(-2), env);
  ASSERT_EQ(episodes.size(), 4U);
  const double seconds[] = {10, 10.02, 2, -1};
  for (size_t i = 0; i < 4; ++i) {
    EXPECT_EQ(episodes[i].success, i % 2 == 0);
    ASSERT_EQ(episodes[i].swing_up_seconds.has_value(), i < 3);
    EXPECT_DOUBLE_EQ(episodes[i].swing_up_seconds.value_or(-1), seconds[i]);
    EXPECT_DOUBLE_EQ(episodes[i].seconds, 20);
    EXPECT_DOUBLE_EQ(episodes[i].terms[0], 500 * 501 / 2.0);
  }
  const Evaluation summary = Summarize(episodes, env.spec().evaluation);
  EXPECT_EQ(summary.successes, Evaluate(Constant(-2), again).successes);
  EXPECT_EQ(summary.swing_up_seconds.median, 6);
}

/// Environment 0 leans 1° and -2° from its state 150 on; environment 1 always leans 10°. Step sets
/// the torques.
class LeaningEnv : public ScriptedEnv {
 public:
  LeaningEnv() : ScriptedEnv({100, 100}) { spec_.bodies = 2; }
  void Lean(int env, std::span<double> lean) const override {
    const bool upright = env == 0 && k >= 150;
    lean[0] = upright ? kDegree : 10 * kDegree;
    lean[1] = upright ? -2 * kDegree : 0;
  }
  void Step(Matrix<const double> action, StepResult& r) override {
    ScriptedEnv::Step(action, r);
    ++k;
    // Up to state 100 the torque changes by 1 N·m at each step, later by 0.5 N·m at every fifth
    // step.
    for (double& x : r.torque) x = k <= 100 ? k % 2 : 0.5 * (k / 5 % 2);
  }
  static constexpr double kDegree = std::numbers::pi / 180;
  int k = 0;
};

TEST(Evaluate, SettlingTimeTorqueVariationAndTilt) {
  LeaningEnv env;
  const std::vector<EvaluationEpisode> episodes = EvaluateEpisodes(Constant(0), env);
  EXPECT_TRUE(episodes[0].success && episodes[1].success);
  EXPECT_DOUBLE_EQ(episodes[0].settling_seconds.value(), 3);
  EXPECT_FALSE(episodes[1].settling_seconds);  // the lean is more than 9°
  EXPECT_NEAR(episodes[0].tilt[0], env.kDegree, 1e-12);
  EXPECT_NEAR(episodes[0].tilt[1], -2 * env.kDegree, 1e-12);
  // 99 changes of 1 N·m, then changes of 0.5 N·m at 105, 110, …, 1000: 180 of them in 18 s.
  EXPECT_DOUBLE_EQ(episodes[0].torque_variation, (99 + 180 * 0.5) / 20);
  EXPECT_DOUBLE_EQ(episodes[0].goal_variation, 180 * 0.5 / 18);
  EXPECT_DOUBLE_EQ(episodes[0].goal_changes, 10);

  const Evaluation e = Summarize(episodes, env.spec().evaluation);
  EXPECT_EQ(e.settled, 1);
  EXPECT_DOUBLE_EQ(e.settling_seconds.median, 3);
  ASSERT_EQ(e.tilt.size(), 2U);
  EXPECT_NEAR(e.tilt[1].mean, env.kDegree, 1e-12);  // mean of 2° and 0°
  EXPECT_DOUBLE_EQ(e.goal_changes.mean, 10);
}

TEST(Evaluate, TorqueChangesBelowAThousandthOfTheLimitAreNoChatter) {
  const std::vector<double> limit{5};
  TorqueTally tally(limit, 0.1);
  for (const double torque : {0.0, 0.004, 0.008, 0.02}) tally.Add({&torque, 1}, true);
  EvaluationEpisode episode;
  tally.Finish(true, episode);
  EXPECT_DOUBLE_EQ(episode.goal_changes, 1 / (3 * 0.1));
  EXPECT_DOUBLE_EQ(episode.goal_variation, 0.02 / (3 * 0.1));
}

TEST(Evaluate, AStretchAtTheGoalCountsItsOwnChangesOnly) {
  ScriptedEnv never({2000}), whole({1});
  EXPECT_EQ(EvaluateEpisodes(Constant(1), never)[0].goal_changes, 0);
  EXPECT_EQ(EvaluateEpisodes(Constant(1), whole)[0].torque_variation, 0);
  EXPECT_TRUE(Evaluate(Constant(1), whole).tilt.empty());  // the task has no bodies
}

/// A dueling policy of one observation; its torque often changes with the observation.
NetworkPolicy Fickle() {
  NetworkPolicyParts parts{ActionRule::kLevels, {1, {32, 32}, 9, true, Activation::kRelu, 16}};
  const Network network(parts.shape);
  parts.parameters.resize(network.num_parameters());
  parts.torques = {-0.8, -0.6, -0.4, -0.2, 0, 0.2, 0.4, 0.6, 0.8};
  Rng rng(3, "fickle");
  network.Initialize(rng, parts.parameters);
  return {parts, Units(0.9, 1)};
}

TEST(Evaluate, ThreadsChangeNoBit) {
  const auto episodes = [](ThreadPool* pool) {
    ToyEnv env(203);  // slices of unequal size
    env.episode_steps = 30;
    return EvaluateEpisodes(Fickle(), env, pool);
  };
  const std::vector<EvaluationEpisode> alone = episodes(nullptr);
  std::vector<double> rms;
  rms.reserve(alone.size());
  for (const EvaluationEpisode& episode : alone) rms.push_back(episode.rms_torque);
  EXPECT_GT(MomentsOf(rms).deviation, 0);  // the episodes differ
  for (const int threads : {1, 2, 5}) {
    ThreadPool pool(threads);
    const std::vector<EvaluationEpisode> shared = episodes(&pool);
    for (size_t i = 0; i < alone.size(); ++i) {
      ASSERT_EQ(alone[i].reward_sum, shared[i].reward_sum) << i;
      ASSERT_EQ(alone[i].rms_torque, shared[i].rms_torque) << i;
      ASSERT_EQ(alone[i].swing_up_seconds, shared[i].swing_up_seconds) << i;
    }
  }
}

TEST(Evaluate, ThreadsMayShareAPolicy) {
  const NetworkPolicy policy = Fickle();
  const auto value = [&](int seed) {
    ToyEnv env(203, static_cast<uint64_t>(seed));
    return Evaluate(policy, env).value;
  };
  constexpr int kEvaluations = 16;
  std::vector<double> alone, together(kEvaluations);
  for (int i = 0; i < kEvaluations; ++i) alone.push_back(value(i));
  ThreadPool pool(4);
  pool.ParallelFor(kEvaluations, [&](int i) { together[static_cast<size_t>(i)] = value(i); });
  EXPECT_EQ(together, alone);
}

}  // namespace
}  // namespace upswing
