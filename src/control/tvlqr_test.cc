#include "control/tvlqr.h"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

#include "base/error.h"
#include "base/rng.h"
#include "control/hybrid.h"
#include "control/mpc.h"
#include "control/swing_up.h"

namespace upswing {
namespace {

/// Simulates a policy for some seconds. Returns the deviations from upright, the first included.
std::vector<StateVector> Simulate(const Policy& policy, const StateVector& start, double seconds,
                                  const Plant& plant) {
  PendulumModel model(plant);
  const auto memory = policy.Start(1);
  std::vector<StateVector> deviations;
  StateVector x = start;
  for (double t = 0; t < seconds; t += kControlPeriod) {
    deviations.push_back(UprightDeviation(x));
    const auto obs = Observe(plant, {x[0], x[1], x[2], x[3]});
    double u = 0;
    policy.Act(Matrix<const float>(obs, 1, kObservationSize), Matrix<double>(&u, 1, 1), *memory);
    EXPECT_LE(std::abs(u), plant.torque_limit);
    model.Step({&x, 1}, {&u, 1});
  }
  deviations.push_back(UprightDeviation(x));
  return deviations;
}

StateVector NearHanging(Rng& rng) {
  return 0.1 * StateVector(rng.Normal(), rng.Normal(), rng.Normal(), rng.Normal());
}

TEST(Tvlqr, SwingsUpFromWhereverItHangs) {
  const Plant plant;
  const TvlqrPolicy policy(LqrConfig(), SwingUpConfig(), plant);
  Rng rng(1, "starts");
  for (int trial = 0; trial < 20; ++trial) {
    EXPECT_LT(Simulate(policy, NearHanging(rng), 8, plant).back().norm(), 1e-3);
  }
}

TEST(Tvlqr, BeginsWhereItIs) {
  const Plant plant;
  const TvlqrPolicy policy(LqrConfig(), SwingUpConfig(), plant);
  for (const double sign : {1.0, -1.0}) {
    // Upright, the policy holds at once. In the middle of its plan or the mirror image, it
    // continues.
    const auto held = Simulate(policy, FromUpright(sign * StateVector(0.03, 0, 0, 0)), 5, plant);
    for (const StateVector& d : held) EXPECT_LT(std::abs(d[0]), 0.3);
    const auto middle = static_cast<size_t>(policy.plan().trajectory.steps() / 3);
    const StateVector x = sign * policy.plan().trajectory.x[middle];
    EXPECT_LT(Simulate(policy, x, 6, plant).back().norm(), 1e-3);
  }
}

TEST(Tvlqr, SaysThatItFoundNoPlan) {
  SwingUpConfig hasty;
  hasty.seconds = 1;
  EXPECT_THROW(TvlqrPolicy(LqrConfig(), hasty, Plant()), Error);
}

TEST(Mpc, SwingsUpAndHolds) {
  const Plant plant;
  const MpcPolicy policy(LqrConfig(), MpcConfig(), plant);
  Rng rng(2, "starts");
  for (int trial = 0; trial < 5; ++trial) {
    EXPECT_LT(Simulate(policy, NearHanging(rng), 6, plant).back().norm(), 1e-3);
  }
}

TEST(Mpc, UprightItIsTheRegulator) {
  const Plant plant;
  const LqrConfig config;
  const MpcPolicy mpc(config, MpcConfig(), plant);
  const LqrPolicy lqr(config, plant);
  const StateVector start = FromUpright({0.0004, 0.0002, 0, 0.001});
  const auto one = Simulate(mpc, start, 2, plant), other = Simulate(lqr, start, 2, plant);
  for (size_t t = 0; t < one.size(); ++t) EXPECT_LT((one[t] - other[t]).norm(), 2e-5);
}

TEST(Mpc, MoreGuessesSwingUpNoLess) {
  const Plant plant;
  const auto upright = [&](int64_t guesses) {
    MpcConfig config;
    config.seconds = 0.5;
    config.guesses = guesses;
    const MpcPolicy policy(LqrConfig(), config, plant);
    Rng rng(3, "starts");
    int successes = 0;
    for (int trial = 0; trial < 10; ++trial) {
      const StateVector start{rng.Uniform(-3, 3), rng.Uniform(-3, 3), 0, 0};
      if (Simulate(policy, start, 2, plant).back().norm() < 0.1) ++successes;
    }
    return successes;
  };
  const int one = upright(1);
  EXPECT_GT(one, 0);
  EXPECT_GE(upright(5), one);
}

TEST(Mpc, SwingsBackToAGoalWithinTheRange) {
  const Plant plant;
  const auto turned = [&](double angle_range) {
    MpcConfig config;
    config.angle_range = angle_range;
    const MpcPolicy policy(LqrConfig(), config, plant);
    // Link 1 passes upright.
    const auto d = Simulate(policy, {2, 0, 9, 0}, 8, plant);
    EXPECT_LT(d.back().norm(), 1e-3);
    double sum = d[0][0];
    for (size_t t = 1; t < d.size(); ++t) sum += Wrapped(d[t][0] - d[t - 1][0]);
    return sum / (2 * std::numbers::pi);
  };
  EXPECT_GT(turned(MpcConfig().angle_range), 0.9);
  EXPECT_NEAR(turned(4), 0, 1e-3);
}

TEST(Mpc, BrakesAFastJoint) {
  for (const double joint : {1, 2}) {
    Plant plant;
    plant.actuated_joint = joint;
    const size_t w = joint == 1 ? 2 : 3;
    Rng rng(4, "states");
    int accelerates = 0;
    for (int trial = 0; trial < 10; ++trial) {
      StateVector x;
      for (double& number : x) number = rng.Uniform(-3, 3);
      x[w] = trial % 2 == 0 ? 6 : -6;
      const auto torque = [&](double velocity) {
        MpcConfig config;
        config.velocity = velocity;
        const MpcPolicy policy(LqrConfig(), config, plant);
        const auto obs = Observe(plant, {x[0], x[1], x[2], x[3]});
        double u = 0;
        policy.Act(Matrix<const float>(obs, 1, kObservationSize), Matrix<double>(&u, 1, 1),
                   *policy.Start(1));
        return u;
      };
      const double free = torque(MpcConfig().velocity);
      if (free * x[w] <= 0) {
        EXPECT_EQ(torque(4), free);
        continue;
      }
      ++accelerates;
      EXPECT_NEAR(torque(6), 0, 1e-3 * std::abs(free));
      EXPECT_NEAR(torque(4), -free, 1e-9);
      EXPECT_NEAR(torque(9.1), free, 1e-9);
    }
    EXPECT_GE(accelerates, 3) << joint;
  }
}

TEST(Hybrid, CatchesTheSwingUpOfALaw) {
  const Plant plant;
  PartialFeedbackConfig pfl;
  LqrConfig lqr;
  const Manipulator manipulator = ManipulatorOf(plant);
  const auto law = std::make_shared<LawPolicy>(
      "law", "a law", OptionsOf(pfl), plant,
      [&](const StateVector& d) { return PartialFeedbackTorque(pfl, manipulator, d); });
  const HybridPolicy hybrid("pfl", OptionsOf(pfl), lqr, law, plant);
  Rng rng(3, "starts");
  int up = 0, up_alone = 0;
  for (int trial = 0; trial < 10; ++trial) {
    const StateVector start = NearHanging(rng);
    if (Simulate(hybrid, start, 20, plant).back().norm() < 1e-3) ++up;
    if (Simulate(*law, start, 20, plant).back().norm() < 1e-3) ++up_alone;
  }
  EXPECT_GE(up, 8);
  EXPECT_EQ(up_alone, 0);
}

}  // namespace
}  // namespace upswing
