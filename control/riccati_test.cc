#include "control/riccati.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>

#include "control/testing.h"

namespace upswing {
namespace {

using Eigen::MatrixXd;

TEST(Riccati, EqualsSciPy) {
  int cases = 0;
  for (const RiccatiCase& c : SciPyCases()) {
    SCOPED_TRACE(c.name);
    const auto P = SolveRiccati(c.A, c.B, c.Q, c.R);
    ASSERT_TRUE(P.has_value());
    EXPECT_LT((*P - c.P).norm(), 1e-9 * c.P.norm());
    EXPECT_LT((*P - P->transpose()).norm(), 1e-15 * c.P.norm());
    EXPECT_LT(RiccatiResidual(*P, c.A, c.B, c.Q, c.R), 1e-9);
    const MatrixXd K = GainOf(*P, c.A, c.B, c.R);
    EXPECT_NEAR(SpectralRadius(c.A - c.B * K), c.spectral_radius, 1e-8);
    ++cases;
  }
  EXPECT_GE(cases, 13);
}

TEST(Riccati, EqualsTheRecursionOfLongerAndLongerHorizons) {
  const RiccatiCase c = SciPyCases().front();
  MatrixXd P = c.Q;  // of one step; 4,096 more are as good as infinitely many
  for (int step = 0; step < 4096; ++step) {
    P = c.Q + c.A.transpose() * P * (c.A - c.B * GainOf(P, c.A, c.B, c.R));
  }
  const auto solution = SolveRiccati(c.A, c.B, c.Q, c.R);
  ASSERT_TRUE(solution.has_value());
  EXPECT_LT((*solution - P).norm(), 1e-9 * P.norm());
}

TEST(Riccati, OneStateByHand) {
  // P = 1 + 4 P - 4 P²/(1 + P) → P² - 4 P - 1 = 0
  const MatrixXd one = MatrixXd::Ones(1, 1);
  const auto P = SolveRiccati(2 * one, one, one, one);
  ASSERT_TRUE(P.has_value());
  EXPECT_NEAR((*P)(0, 0), 2 + std::sqrt(5), 1e-14);
}

TEST(Riccati, ResidualSeesAnError) {
  const RiccatiCase c = SciPyCases().front();
  EXPECT_GT(RiccatiResidual(1.001 * c.P, c.A, c.B, c.Q, c.R), 1e-5);
}

TEST(Riccati, NoSolutionWhereAGrowingModeCannotBeReached) {
  MatrixXd A(2, 2), B(2, 1);
  A << 1.1, 0, 0.3, 0.5;
  B << 0, 1;
  const MatrixXd Q = MatrixXd::Identity(2, 2), R = MatrixXd::Identity(1, 1);
  EXPECT_FALSE(IsStabilizable(A, B));
  EXPECT_FALSE(SolveRiccati(A, B, Q, R).has_value());
  A(0, 0) = 0.9;  // that mode decays by itself
  EXPECT_TRUE(IsStabilizable(A, B));
  EXPECT_TRUE(SolveRiccati(A, B, Q, R).has_value());
}

TEST(Riccati, NoSolutionWhereAGrowingModeCostsNothing) {
  MatrixXd A(2, 2), Q(2, 2);
  A << 1.1, 0, 0, 0.5;
  Q << 0, 0, 0, 1;
  const MatrixXd B = MatrixXd::Ones(2, 1), R = MatrixXd::Identity(1, 1);
  EXPECT_TRUE(IsStabilizable(A, B));
  EXPECT_FALSE(SolveRiccati(A, B, Q, R).has_value());  // the least cost is that of u = 0
  Q(0, 0) = 1e-6;
  EXPECT_TRUE(SolveRiccati(A, B, Q, R).has_value());
}

TEST(Riccati, NoSolutionOfWhatIsNotFinite) {
  const MatrixXd one = MatrixXd::Ones(1, 1);
  EXPECT_FALSE(SolveRiccati(one * std::numeric_limits<double>::infinity(), one, one, one));
  EXPECT_FALSE(SolveRiccati(one * std::numeric_limits<double>::quiet_NaN(), one, one, one));
}

}  // namespace
}  // namespace upswing
