#include "control/riccati.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>

#include "control/testing.h"

namespace upswing {
namespace {

using Eigen::Matrix4d;
using Eigen::Vector4d;

/// A system with two states, padded with two zero states.
LinearModel Two(double a11, double a12, double a21, double a22, double b1, double b2) {
  LinearModel model{Matrix4d::Zero(), {b1, b2, 0, 0}};
  model.A.topLeftCorner<2, 2>() << a11, a12, a21, a22;
  return model;
}

TEST(Riccati, EqualsSciPy) {
  int cases = 0;
  for (const RiccatiCase& c : SciPyCases()) {
    SCOPED_TRACE(c.name);
    const auto lqr = SolveDiscreteLqr(c.model, c.Q, c.R);
    ASSERT_TRUE(lqr.has_value());
    EXPECT_LT((lqr->P - c.P).norm(), 1e-9 * c.P.norm());
    EXPECT_LT((lqr->P - lqr->P.transpose()).norm(), 1e-15 * c.P.norm());
    EXPECT_NEAR(SpectralRadius(c.model.A - c.model.B * lqr->K), c.spectral_radius, 1e-8);
    ++cases;
  }
  EXPECT_EQ(cases, 10);
}

TEST(Riccati, EqualsTheRecursionOfLongerAndLongerHorizons) {
  const RiccatiCase c = SciPyCases().front();
  const auto& [A, B] = c.model;
  Matrix4d P = c.Q;  // cost of one step; 4,096 more are practically infinitely many
  for (int step = 0; step < 4096; ++step) {
    const Eigen::RowVector4d K = B.transpose() * P * A / (c.R + B.dot(P * B));
    P = (c.Q + A.transpose() * P * (A - B * K)).eval();
  }
  const auto lqr = SolveDiscreteLqr(c.model, c.Q, c.R);
  ASSERT_TRUE(lqr.has_value());
  EXPECT_LT((lqr->P - P).norm(), 1e-9 * P.norm());
}

TEST(Riccati, OneStateByHand) {
  // P = 1 + 4 P - 4 P²/(1 + P) → P² - 4 P - 1 = 0
  const Matrix4d Q = Vector4d(1, 0, 0, 0).asDiagonal();
  const auto lqr = SolveDiscreteLqr(Two(2, 0, 0, 0, 1, 0), Q, 1);
  ASSERT_TRUE(lqr.has_value());
  EXPECT_NEAR(lqr->P(0, 0), 2 + std::sqrt(5), 1e-14);
}

TEST(Riccati, NoSolutionWhereAGrowingModeCannotBeReached) {
  const Matrix4d Q = Matrix4d::Identity();
  EXPECT_FALSE(SolveDiscreteLqr(Two(1.1, 0, 0.3, 0.5, 0, 1), Q, 1).has_value());
  EXPECT_TRUE(SolveDiscreteLqr(Two(0.9, 0, 0.3, 0.5, 0, 1), Q, 1).has_value());  // it decays
}

TEST(Riccati, NoSolutionWhereAGrowingModeCostsNothing) {
  const LinearModel model = Two(1.1, 0, 0, 0.5, 1, 1);
  Matrix4d Q = Vector4d(0, 1, 0, 0).asDiagonal();
  EXPECT_FALSE(SolveDiscreteLqr(model, Q, 1).has_value());  // the cheapest control is u = 0
  Q(0, 0) = 1e-6;
  EXPECT_TRUE(SolveDiscreteLqr(model, Q, 1).has_value());
}

TEST(Riccati, NoSolutionForNumbersThatAreNotFinite) {
  const Matrix4d Q = Matrix4d::Identity();
  for (const double x :
       {std::numeric_limits<double>::infinity(), std::numeric_limits<double>::quiet_NaN()}) {
    EXPECT_FALSE(SolveDiscreteLqr(Two(x, 0, 0, 0, 1, 0), Q, 1));
  }
}

}  // namespace
}  // namespace upswing
