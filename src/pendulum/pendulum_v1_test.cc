#include "pendulum/pendulum_v1.h"

#include <gtest/gtest.h>

#include <array>
#include <cmath>

#include "pendulum/testing.h"

namespace upswing {
namespace {

/// Fixture: one step of one environment from a state under a torque.
class PendulumV1Step : public testing::Test {
 protected:
  void Step(double theta, double omega, double torque) {
    env_.SetState(0, std::array{theta, omega});
    env_.Step({&torque, 1, 1}, result_);
    env_.GetState(0, next_);
  }

  PendulumV1 env_{{}};
  StepResult result_{env_.spec()};
  std::array<double, 2> next_{};  // theta, omega
};

TEST_F(PendulumV1Step, RewardHasTermsOfTheStateBefore) {
  Step(0.5, -2, 1.5);
  EXPECT_DOUBLE_EQ(result_.reward_terms[0], -0.25);
  EXPECT_DOUBLE_EQ(result_.reward_terms[1], -0.4);
  EXPECT_DOUBLE_EQ(result_.reward_terms[2], -0.00225);
  EXPECT_DOUBLE_EQ(result_.reward[0], -0.65225);
}

TEST_F(PendulumV1Step, TorqueBeyondItsLimitIsClamped) {
  Step(0.5, -2, 2);
  const std::array expected = next_;
  Step(0.5, -2, 50);
  EXPECT_EQ(next_, expected);
  EXPECT_EQ(result_.torque[0], 2);
}

TEST_F(PendulumV1Step, WorkIsTorqueTimesAngle) {
  Step(3.1, 2, -1.5);  // crosses π, where the angle wraps
  EXPECT_LT(next_[0], 0);
  EXPECT_NEAR(result_.work[0], 1.5 * (next_[0] + 2 * kPi - 3.1), 1e-14);
}

TEST_F(PendulumV1Step, TheGoalIsWithinFiveDegreesOfUpright) {
  for (const auto& [degrees, at_goal] : {std::pair(0.0, 1), {4.9, 1}, {5.1, 0}, {180.0, 0}}) {
    for (const double theta : {degrees * kPi / 180, -degrees * kPi / 180}) {
      // A velocity and a torque that hold the angle for one step: u = -5 sin theta, if the limit
      // allows it.
      Step(theta, 0, -5 * std::sin(theta));
      EXPECT_NEAR(std::abs(next_[0]), std::abs(theta), 1e-12);
      EXPECT_EQ(result_.at_goal[0], at_goal) << theta;
      std::array<double, 1> lean{};
      env_.Lean(0, lean);
      EXPECT_EQ(lean[0], next_[0]);
    }
  }
}

}  // namespace
}  // namespace upswing
