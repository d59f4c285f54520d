#include "control/trajectory.h"

#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <numbers>
#include <utility>
#include <vector>

#include "control/lqr.h"
#include "control/testing.h"

namespace upswing {
namespace {

QuadraticCost StandardCost(const LqrConfig& config, const Plant& plant) {
  return {WeightsOf(config), config.torque, SolveLqr(config, plant).P};
}

TEST(Trajectory, EqualsSciPyWhereThePendulumIsLinear) {
  const nlohmann::json file = TestData("boxed.json");
  for (const auto& c : file.at("cases")) {
    Plant plant;
    plant.torque_limit = c.at("limit");
    const QuadraticCost cost = StandardCost(LqrConfig(), plant);
    const auto start = c.at("start").get<std::vector<double>>();
    const auto expected = c.at("torques").get<std::vector<double>>();
    TrajectoryOptimizer optimizer(plant);
    Trajectory trajectory = optimizer.Follow(cost, FromUpright(StateVector(start.data())),
                                             std::vector<double>(expected.size(), 0.0));
    optimizer.Improve(cost, 0, 200, trajectory);
    EXPECT_NEAR(trajectory.cost, c.at("cost"), 1e-5 * c.at("cost").get<double>());
    for (size_t t = 0; t < expected.size(); ++t) {
      EXPECT_NEAR(trajectory.u[t], expected[t], 1e-3 * 1e-3) << "step " << t;
    }
  }
}

TEST(QuadraticCost, CountsGoalsWithinTheRange) {
  constexpr double kPi = std::numbers::pi;
  const Eigen::Matrix4d Q = Eigen::Vector4d(1, 2, 0, 0).asDiagonal();
  const auto cost = [&](double range, double q1, double q2) {
    const QuadraticCost quadratic(Q, 1, 3 * Q, range);
    const StateVector x(q1, q2, 0, 0);
    const double running = quadratic.Running(x, 0);
    EXPECT_NEAR(quadratic.Final(x), 3 * running, 1e-9);
    // The expansion's slope against differences.
    constexpr double kStep = 1e-6;
    const StateVector step(kStep, 0.5 * kStep, 0, 0);
    const double slope = (quadratic.Running(x + step, 0) - quadratic.Running(x - step, 0)) / 2;
    EXPECT_NEAR(quadratic.ExpandRunning(x, 0).x.dot(step), slope, 1e-9);
    EXPECT_NEAR(quadratic.ExpandFinal(x).x.dot(step), 3 * slope, 1e-9);
    return running;
  };
  const auto square = [](double x) { return x * x; };
  for (const double sign : {1.0, -1.0}) {
    EXPECT_NEAR(cost(1e6, sign * 3.1 * kPi, sign * 4 * kPi), square(0.1 * kPi), 1e-9);
    EXPECT_NEAR(cost(12.5, sign * 3.1 * kPi, sign * 4 * kPi),
                square(0.1 * kPi) + 2 * square(2 * kPi), 1e-9);
    EXPECT_NEAR(cost(4, sign * 3.1 * kPi, sign * 2 * kPi), square(2.1 * kPi) + 2 * square(2 * kPi),
                1e-9);
    EXPECT_NEAR(cost(kPi, sign * 0.9 * kPi, 0), square(0.1 * kPi), 1e-9);
    EXPECT_NEAR(cost(4, sign * 0.9 * kPi, sign * 0.2), square(0.1 * kPi) + 2 * square(0.2), 1e-9);
  }
}

TEST(Trajectory, FollowsSeveralPlansAsOneByOne) {
  const Plant plant;
  const QuadraticCost cost = StandardCost(LqrConfig(), plant);
  TrajectoryOptimizer optimizer(plant);
  const StateVector start(0.1, -0.2, 0.3, -0.4);
  const Trajectory a = optimizer.Follow(cost, StateVector::Zero(), std::vector<double>(30, 2.0));
  const Trajectory b = optimizer.Follow(cost, start, std::vector<double>(30, -1.0));
  const std::vector<Eigen::RowVector4d> weak(30, {-1, 0, -0.1, 0}), strong(30, {-9, -9, -2, -1});
  const std::array<TrajectoryOptimizer::FeedbackPlan, 2> plans{{{a, weak}, {b, strong}}};
  const std::vector<Trajectory> both = optimizer.Follow(cost, start, plans);
  ASSERT_EQ(both.size(), 2U);
  for (size_t i = 0; i < 2; ++i) {
    const Trajectory alone = std::move(optimizer.Follow(cost, start, {&plans[i], 1}).front());
    EXPECT_EQ(both[i].u, alone.u);
    EXPECT_EQ(both[i].x, alone.x);
    EXPECT_EQ(both[i].cost, alone.cost);
  }
  EXPECT_NE(both[0].u, both[1].u);
}

TEST(Trajectory, NoChangeOfATorqueIsBetter) {
  // Pontryagin's condition in discrete time: the derivative of the cost by each torque is 0 within
  // the limits and points outwards at them. The derivatives are differences of whole simulations,
  // independent of the optimisation method.
  const Plant plant;
  LqrConfig config;
  const QuadraticCost cost = StandardCost(config, plant);
  TrajectoryOptimizer optimizer(plant);
  std::vector<double> guess(180);
  for (size_t t = 0; t < guess.size(); ++t) guess[t] = 3 * std::sin(0.08 * static_cast<double>(t));
  Trajectory best = optimizer.Follow(cost, StateVector::Zero(), guess);
  optimizer.Improve(cost, 1e-12, 1000, best);

  int at_limit = 0;
  for (size_t t = 0; t < best.u.size(); t += 3) {
    const auto cost_with = [&](double change) {
      Trajectory other = best;
      other.u[t] += change;
      double sum = 0;
      for (size_t k = 0; k < other.u.size(); ++k) {
        sum += cost.Running(other.x[k], other.u[k]);
        other.x[k + 1] = other.x[k];
        optimizer.model().Step({&other.x[k + 1], 1}, {&other.u[k], 1});
      }
      return sum + cost.Final(other.x.back());
    };
    constexpr double e = 1e-4;
    const double slope = (cost_with(e) - cost_with(-e)) / (2 * e);
    if (std::abs(best.u[t]) > plant.torque_limit - 1e-9) {
      ++at_limit;
      EXPECT_LT(slope * best.u[t], 1e-3 * best.cost) << "step " << t;
    } else {
      EXPECT_LT(std::abs(slope), 1e-3 * best.cost) << "step " << t;
    }
  }
  EXPECT_GT(at_limit, 5);  // the motor reaches its limits
  EXPECT_LT(UprightDeviation(best.x.back()).norm(), 0.1);
}

TEST(Trajectory, FollowsWithinTheLimitAndCountsTheCost) {
  const Plant plant;
  const QuadraticCost cost(Eigen::Matrix4d::Zero(), 2, Eigen::Matrix4d::Identity());
  TrajectoryOptimizer optimizer(plant);
  const Trajectory t = optimizer.Follow(cost, StateVector::Zero(), {1, -3, 9});
  EXPECT_EQ(t.u, (std::vector<double>{1, -3, 5}));
  EXPECT_NEAR(t.cost, 2 * (1 + 9 + 25) + UprightDeviation(t.x[3]).squaredNorm(), 1e-12);
}

}  // namespace
}  // namespace upswing
