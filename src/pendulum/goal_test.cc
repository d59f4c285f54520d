#include "pendulum/goal.h"

#include <gtest/gtest.h>

#include <cmath>

#include "pendulum/testing.h"

namespace upswing {
namespace {

TEST(Pose, IsARestThatMovesNothing) {
  for (const Pose& pose : kPoses) {
    const PendulumState rest = RestIn(pose), seen = SeenFrom(pose, rest);
    EXPECT_TRUE(Inverted(seen)) << PoseName(pose);
    EXPECT_NEAR(std::cos(rest.q1), pose.up1 ? -1 : 1, 1e-15);
    EXPECT_NEAR(std::cos(rest.q1 + rest.q2), pose.up2 ? -1 : 1, 1e-15);
    EXPECT_NEAR(std::sin(rest.q1) + std::sin(rest.q1 + rest.q2), 0, 1e-15);  // no gravity torque
    for (const Pose& other : kPoses) {
      EXPECT_EQ(Inverted(SeenFrom(other, rest)), other == pose) << PoseName(other);
    }
  }
  EXPECT_EQ(PoseName({true, false}), "up-down");
}

TEST(Reward, OfAGoalByHand) {
  const Plant plant;  // links of equal mass and length: at rest Ê is 1, 3/4, 1/4, 0
  const double energy[] = {1, 0.75, 0.25, 0};
  for (size_t i = 0; i < kPoses.size(); ++i) {
    for (size_t k = 0; k < kPoses.size(); ++k) {
      const auto terms = RewardTerms(plant, RestIn(kPoses[i]), 2, kPoses[k]);
      EXPECT_NEAR(terms[0], 1 - std::abs(energy[i] - energy[k]), 1e-15);
      EXPECT_EQ(terms[2], i == k ? 5 : 0);
      EXPECT_EQ(terms[4], (i == k ? -0.05 : -0.01) * 4);
    }
  }
  // Link 1 points at the goal, link 2 away from it: half of the height.
  EXPECT_NEAR(RewardTerms(plant, RestIn({true, true}), 0, Pose{true, false})[1], 0.5, 1e-15);
  EXPECT_NEAR(RewardTerms(plant, RestIn({false, true}), 0, Pose{false, true})[1], 1, 1e-15);
  // Hanging and much too fast for it: no energy term, and the velocities cost 0.01 (12² + 1²).
  const auto fast = RewardTerms(plant, {0, 0, 12, -1}, 0, Pose{false, false});
  EXPECT_EQ(fast[0], 0);
  EXPECT_DOUBLE_EQ(fast[3], -1.45);
  // Upright, the built-in reward differs only in the energy beyond that of the goal.
  const PendulumState slow{kPi - 0.1, 0.1, 0.1, -0.2};
  const auto built_in = RewardTerms(plant, slow, 1), own = RewardTerms(plant, slow, 1, Pose());
  for (size_t k = 0; k < built_in.size(); ++k) EXPECT_NEAR(built_in[k], own[k], 1e-15);
}

}  // namespace
}  // namespace upswing
