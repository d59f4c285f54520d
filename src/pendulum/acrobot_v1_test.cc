#include "pendulum/acrobot_v1.h"

#include <gtest/gtest.h>

#include <array>
#include <numbers>
#include <vector>

#include "base/testing.h"

namespace upswing {
namespace {

/// A state just below the goal line, which the next step crosses. The first link is about level and
/// rising, the second points straight up.
constexpr std::array kBelowTheLine{1.5, 1.6, 2.0, 0.0};

void Step(AcrobotV1& env, double torque, StepResult& result) { env.Step({&torque, 1, 1}, result); }

TEST(AcrobotV1, CrossingTheLineTerminatesWithoutCost) {
  AcrobotV1 env({});
  StepResult result(env.spec());
  Step(env, 1, result);
  EXPECT_EQ(result.reward[0], -1);
  EXPECT_EQ(result.at_goal[0], 0);
  env.SetState(0, kBelowTheLine);
  Step(env, 1, result);
  EXPECT_EQ(result.terminated[0], 1);
  EXPECT_EQ(result.truncated[0], 0);
  EXPECT_EQ(result.at_goal[0], 1);
  EXPECT_EQ(result.reward[0], 0);
  // The observation of the successor is above the line; the next episode begins hanging.
  const auto& obs = result.next_obs;  // cos(a + b) = cos a cos b - sin a sin b
  EXPECT_GT(-obs[0] - (obs[0] * obs[2] - obs[1] * obs[3]), 1);
  EXPECT_GT(env.obs()(0, 0), 0.99);
}

TEST(AcrobotV1, TheLastStepTerminatesOrTruncatesButNotBoth) {
  for (const auto& start : {std::array{0.0, 0.0, 0.0, 0.0}, kBelowTheLine}) {
    AcrobotV1 env({});
    env.SetState(0, start);
    // The same state, but after 499 steps.
    std::vector<int64_t> step_counts{499};
    SaveAndLoad(
        [&](const Archive& archive) {
          env.State(archive);
          archive.Array("step_counts", std::span(step_counts), kAnyNumber<int64_t>);
        },
        [&](const Archive& archive) { env.State(archive); });
    StepResult result(env.spec());
    Step(env, 1, result);
    EXPECT_EQ(result.terminated[0], start == kBelowTheLine);
    EXPECT_EQ(result.truncated[0], start != kBelowTheLine);
  }
}

TEST(AcrobotV1, WorkIsTorqueTimesTheSecondJointsAngle) {
  AcrobotV1 env({});
  StepResult result(env.spec());
  env.SetState(0, std::array{0.2, 3.0, -1.0, 2.0});  // crosses π, where the angle wraps
  Step(env, -0.5, result);
  std::array<double, 4> next{};
  env.GetState(0, next);
  ASSERT_LT(next[1], 0);
  EXPECT_NEAR(result.work[0], 0.5 * (next[1] + 2 * std::numbers::pi - 3.0), 1e-14);
}

}  // namespace
}  // namespace upswing
