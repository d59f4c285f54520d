#include "nn/gaussian.h"

#include <gtest/gtest.h>

#include <array>

#include "nn/testing.h"

namespace upswing {
namespace {

TEST(Gaussian, SquashedDensityIntegratesToOne) {
  for (const double log_std : {-3.0, -1.0, 0.0, 0.7}) {
    const auto policy = Gaussian<double>::From(0.4, log_std);
    // ∫ π(a) da over a = tanh(u), by the midpoint rule in u: da = (1 - a²) du.
    double integral = 0;
    constexpr double kStep = 1e-3;
    for (double u = -20; u < 20; u += kStep) {
      const double epsilon = (u + kStep / 2 - policy.mean) / policy.std;
      const Squashed<double> sample = Squash(policy, epsilon);
      integral += std::exp(sample.log_prob) * (1 - sample.action * sample.action) * kStep;
    }
    EXPECT_NEAR(integral, 1, 1e-6) << log_std;
  }
}

TEST(Gaussian, ActionProbabilitiesAreScipys) {
  EXPECT_NEAR(NormalCdf(-8) / 6.22096057427174e-16, 1, 1e-12);
  EXPECT_NEAR(NormalCdf(1), 0.841344746068543, 1e-15);
  struct Case {
    const ActionBound* bound;
    double mean, log_std;
    std::array<double, 6> probabilities;
  };
  // scipy.stats.norm 1.17.1: probability of clipping to -1, of four quarters of the range, and of
  // clipping to 1.
  const std::array<Case, 6> cases{{
      {&kSquash, 0.3, -1, {0, 0.0104814094487, 0.19691609333, 0.543616575317, 0.248985921904, 0}},
      {&kSquash, 2, 1, {0, 0.174164009485, 0.0567747146974, 0.0658425962209, 0.703218679596, 0}},
      {&kSquash, -6, -4, {0, 1, 0, 0, 0, 0}},
      {&kClip,
       0.3,
       -1,
       {0.000204841514538, 0.014624255795, 0.19256840547, 0.499263515063, 0.26480548101,
        0.0285335011478}},
      {&kClip,
       1.4,
       -0.5,
       {3.79594162286e-05, 0.000828454869687, 0.00962732148171, 0.0584307373584, 0.185866588422,
        0.745208938452}},
      {&kClip,
       -0.2,
       1,
       {0.384262978983, 0.0717974387523, 0.0732656535016, 0.0722835450572, 0.0689486866999,
        0.329441697006}},
  }};
  for (const Case& c : cases) {
    std::array<double, 6> got{};
    ActionProbabilities(Gaussian<double>::From(c.mean, c.log_std), *c.bound, got);
    for (size_t i = 0; i < got.size(); ++i) {
      EXPECT_NEAR(got.at(i), c.probabilities.at(i), 1e-11) << c.mean << " " << i;
    }
  }
}

TEST(Gaussian, LogTanhSlopeIsRightWhereTanhHasNoDigitsLeft) {
  // ln(1 - tanh²(u)) = -2 ln cosh(u). By hand at u = 8, where 1 - tanh² is 4.5e-7, and in float at
  // u = 40, where tanh is 1.
  const auto slope = [](auto u) { return LogTanhSlope(u, std::exp(-2 * u)); };
  EXPECT_NEAR(slope(8.0), 2 * std::log(2.0) - 16, 1e-6);
  EXPECT_NEAR(slope(8.0), -2 * std::log(std::cosh(8.0)), 1e-12);
  EXPECT_NEAR(slope(40.0F), 2 * std::log(2.0F) - 80, 1e-4F);
  EXPECT_NEAR(slope(0.0), 0, 1e-15);
}

/// α ln π(a) - Q(a) with Q(a) = sin(3 a), for the action of ε.
double Loss(double mean, double log_std, double epsilon, double alpha) {
  const Squashed<double> sample = Squash(Gaussian<double>::From(mean, log_std), epsilon);
  return alpha * sample.log_prob - std::sin(3 * sample.action);
}

TEST(Gaussian, GradientIsThatOfFiniteDifferences) {
  constexpr double kStep = 1e-5;
  for (const double mean : {-1.5, 0.2, 0.9}) {
    for (const double log_std : {-2.0, 0.3}) {
      for (const double epsilon : {-1.3, 0.1, 2.0}) {
        constexpr double kAlpha = 0.2;
        const auto policy = Gaussian<double>::From(mean, log_std);
        const Squashed<double> sample = Squash(policy, epsilon);
        const auto g = SquashedGradient(policy, sample, kAlpha, 3 * std::cos(3 * sample.action));
        EXPECT_NEAR(g.mean,
                    (Loss(mean + kStep, log_std, epsilon, kAlpha) -
                     Loss(mean - kStep, log_std, epsilon, kAlpha)) /
                        (2 * kStep),
                    1e-8);
        EXPECT_NEAR(g.log_std,
                    (Loss(mean, log_std + kStep, epsilon, kAlpha) -
                     Loss(mean, log_std - kStep, epsilon, kAlpha)) /
                        (2 * kStep),
                    1e-8);
      }
    }
  }
}

TEST(Gaussian, AClampedSpreadHasNoGradient) {
  for (const double log_std : {-7.0, 3.0}) {
    const auto policy = Gaussian<double>::From(0.1, log_std);
    EXPECT_EQ(policy.log_std, std::clamp(log_std, kLogStdLow, kLogStdHigh));
    const auto g = SquashedGradient(policy, Squash(policy, 0.5), 0.2, 1.0);
    EXPECT_EQ(g.log_std, 0);
    EXPECT_NE(g.mean, 0);
  }
  EXPECT_NE(SquashedGradient(Gaussian<double>::From(0.1, -1.0),
                             Squash(Gaussian<double>::From(0.1, -1.0), 0.5), 0.2, 1.0)
                .log_std,
            0);
}

}  // namespace
}  // namespace upswing
