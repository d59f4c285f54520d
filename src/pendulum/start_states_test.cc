#include "pendulum/start_states.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numbers>

#include "pendulum/equations.h"

namespace upswing {
namespace {

constexpr double kPi = std::numbers::pi;

TEST(DriveToPose, EndsAtRestInAnyPose) {
  const Plant plant;
  Rng rng(1, "test");
  PendulumState s;
  double least1 = 9, most1 = -9, least2 = 9, most2 = -9;
  for (int i = 0; i < 100; ++i) {
    s = DriveToPose(plant, s, 10, rng);
    EXPECT_NEAR(s.w1, 0, 1e-3);
    EXPECT_NEAR(s.w2, 0, 1e-3);
    least1 = std::min(least1, s.q1), most1 = std::max(most1, s.q1);
    least2 = std::min(least2, s.q2), most2 = std::max(most2, s.q2);
  }
  EXPECT_LT(std::max(least1, least2), -2.8);
  EXPECT_GT(std::min(most1, most2), 2.8);
  EXPECT_GE(std::min(least1, least2), -kPi);
  EXPECT_LE(std::max(most1, most2), kPi);
}

TEST(DriveToPose, HoldsGravityAndLimitsTheRest) {
  const Plant plant;
  Rng rng(1, "test");
  const double seconds = 0.002;
  const MassMatrix M = ManipulatorOf(plant).Mass(std::cos(0.5));
  for (const double q1 : {0.0, 1.0, kPi}) {
    const auto [end1, end2, w1, w2] = DriveToPose(plant, {q1, 0.5, 0, 0}, seconds, rng);
    EXPECT_NEAR(end1, q1, 1e-3);
    EXPECT_NEAR(end2, 0.5, 1e-3);
    EXPECT_LT(std::abs(M.M11 * w1 + M.M12 * w2), 1.01 * seconds * plant.torque_limit);
    EXPECT_LT(std::abs(M.M12 * w1 + M.M22 * w2), 1.01 * seconds * plant.torque_limit);
  }
}

TEST(DriveToPose, IsFiniteWhereItsStepsAreTooLong) {
  Plant plant;
  plant.damping1 = plant.damping2 = 100;
  Rng rng(1, "test");
  for (int i = 0; i < 100; ++i) {
    const PendulumState s = DriveToPose(plant, {}, 0.2, rng);
    EXPECT_LT(std::abs(s.q1) + std::abs(s.q2) + std::abs(s.w1) + std::abs(s.w2), 300);
  }
}

TEST(DriveToPose, TurnsAJointBack) {
  const Plant plant;
  Rng rng(1, "test");
  // Two turns, of which 0.2 s suffice for less than one.
  EXPECT_LT(DriveToPose(plant, {kPi, 4 * kPi, 0, 0}, 0.2, rng).w2, -5);
  EXPECT_GT(DriveToPose(plant, {kPi, -4 * kPi, 0, 0}, 0.2, rng).w2, 5);
  EXPECT_LT(std::abs(DriveToPose(plant, {1e5, 1e5, 0, 0}, 10, rng).q2), kPi);
  EXPECT_LT(std::abs(DriveToPose(plant, {0, 0, NAN, 1e9}, 10, rng).q2), kPi);
}

}  // namespace
}  // namespace upswing
