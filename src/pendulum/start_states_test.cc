#include "pendulum/start_states.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numbers>

#include "pendulum/equations.h"

namespace upswing {
namespace {

TEST(DriveToPose, EndsAtRestInAnyPose) {
  const Plant plant;
  Rng rng(1, "test");
  double least1 = 9, most1 = -9, least2 = 9, most2 = -9;
  for (int i = 0; i < 100; ++i) {
    const PendulumState s = DriveToPose(plant, 10, rng);
    EXPECT_NEAR(s.w1, 0, 1e-3);
    EXPECT_NEAR(s.w2, 0, 1e-3);
    least1 = std::min(least1, s.q1), most1 = std::max(most1, s.q1);
    least2 = std::min(least2, s.q2), most2 = std::max(most2, s.q2);
  }
  EXPECT_LT(std::max(least1, least2), -2.8);
  EXPECT_GT(std::min(most1, most2), 2.8);
  EXPECT_GE(std::min(least1, least2), -std::numbers::pi);
  EXPECT_LE(std::max(most1, most2), std::numbers::pi);
}

TEST(DriveToPose, BeginsUprightAtRest) {
  const Plant plant;
  Rng rng(1, "test");
  // In one step, gravity is held, and both motors have at most their limit.
  const MassMatrix M = ManipulatorOf(plant).Mass(1);
  for (int i = 0; i < 20; ++i) {
    const auto [q1, q2, w1, w2] = DriveToPose(plant, 0.002, rng);
    EXPECT_NEAR(std::abs(q1), std::numbers::pi, 1e-3);
    EXPECT_NEAR(q2, 0, 1e-3);
    EXPECT_LT(std::abs(M.M11 * w1 + M.M12 * w2), 1.01 * 0.002 * plant.torque_limit);
    EXPECT_LT(std::abs(M.M12 * w1 + M.M22 * w2), 1.01 * 0.002 * plant.torque_limit);
  }
}

TEST(StartStates, AreDrivenWithATime) {
  const Plant plant;
  Rng drawn(1, "test"), driven(1, "test");
  const PendulumState a = StartStates{.random_drive = 0.2}.Random(plant, drawn);
  EXPECT_EQ(a.w2, DriveToPose(plant, 0.2, driven).w2);
  EXPECT_LE(std::abs(StartStates{.random_velocity = 1}.Random(plant, drawn).w2), 1);
}

}  // namespace
}  // namespace upswing
