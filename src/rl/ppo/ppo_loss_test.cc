#include "rl/ppo/ppo_loss.h"

#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <vector>

#include "base/rng.h"
#include "rl/ppo/action_distribution.h"

namespace upswing {
namespace {

/// Derivative of f with respect to x by central differences.
double Numeric(double& x, const std::function<double()>& f) {
  constexpr double kStep = 1e-6;
  const double x0 = x;
  x = x0 + kStep;
  const double up = f();
  x = x0 - kStep;
  const double down = f();
  x = x0;
  return (up - down) / (2 * kStep);
}

TEST(ClippedLoss, IsTheSmallerOfBothProductsAndHasItsGradient) {
  for (const double advantage : {2.0, -2.0}) {
    for (double log_ratio : {-0.5, -0.15, 0.0, 0.15, 0.5}) {
      const double r = std::exp(log_ratio);
      const double clipped = std::min(std::max(r, 0.8), 1.2);
      const LossTerm<double> term = ClippedLoss(r, advantage, 0.2);
      EXPECT_NEAR(term.loss, -std::min(r * advantage, clipped * advantage), 1e-12);
      const double numeric =
          Numeric(log_ratio, [&] { return ClippedLoss(std::exp(log_ratio), advantage, 0.2).loss; });
      EXPECT_NEAR(term.gradient, numeric, 1e-8) << advantage << ' ' << r;
    }
  }
}

TEST(ClippedLoss, HasNoGradientWhereTheRatioHasGoneFarEnough) {
  const double far_up = 1.21, far_down = 0.79;
  EXPECT_EQ(ClippedLoss(far_up, 1.0, 0.2).gradient, 0);
  EXPECT_EQ(ClippedLoss(far_down, -1.0, 0.2).gradient, 0);
  // A step back towards the old policy always has a gradient.
  EXPECT_NEAR(ClippedLoss(far_up, -1.0, 0.2).gradient, 1.21, 1e-12);
  EXPECT_NEAR(ClippedLoss(far_down, 1.0, 0.2).gradient, -0.79, 1e-12);
}

TEST(ValueLoss, OfBothKindsAndItsGradient) {
  // Arguments V, V_old, R. The clipped value is V_old ± 0.2.
  EXPECT_NEAR(ValueLoss(3.0, 1.0, 2.0, 0.0).loss, 0.5, 1e-12);
  // Loss of the clipped value 1.2, although 2 is right.
  EXPECT_NEAR(ValueLoss(2.0, 1.0, 2.0, 0.2).loss, 0.32, 1e-12);
  EXPECT_EQ(ValueLoss(2.0, 1.0, 2.0, 0.2).gradient, 0);
  // Further off than the clipped value.
  EXPECT_NEAR(ValueLoss(3.0, 1.0, 0.0, 0.2).loss, 4.5, 1e-12);
  for (const double epsilon : {0.0, 0.2}) {
    for (double value : {-1.0, 0.9, 1.1, 1.7, 3.0}) {
      for (const double target : {-2.0, 1.05, 1.6}) {
        const double numeric =
            Numeric(value, [&] { return ValueLoss(value, 1.0, target, epsilon).loss; });
        EXPECT_NEAR(ValueLoss(value, 1.0, target, epsilon).gradient, numeric, 1e-8);
      }
    }
  }
}

TEST(KlEstimate, IsZeroAtNoChangeAndElseAboveAndRightOnAverage) {
  EXPECT_EQ(KlEstimate(1.0, 0.0), 0);
  EXPECT_GT(KlEstimate(1.3, std::log(1.3)), 0);
  EXPECT_GT(KlEstimate(0.7, std::log(0.7)), 0);
  // KL(N(0, 1) ‖ N(d, 1)) = d²/2.
  Rng rng(1, "samples");
  const double d = 0.3;
  double sum = 0;
  for (int i = 0; i < 100000; ++i) {
    const double x = rng.Normal();
    const double log_ratio = (x * x - (x - d) * (x - d)) / 2;
    sum += KlEstimate(std::exp(log_ratio), log_ratio);
  }
  EXPECT_NEAR(sum / 100000, d * d / 2, 0.0015);  // about 4 standard errors
}

TEST(DiagonalGaussian, SamplesHaveItsMeanDeviationAndEntropy) {
  const std::vector<double> mean{0.3, -2}, log_std{std::log(0.5), std::log(2.0)}, std{0.5, 2};
  const DiagonalGaussian<double> policy{mean, log_std, std};
  Rng rng(1, "samples");
  std::vector<double> u(2), sum(2), squares(2);
  double log_prob = 0;
  constexpr int kSamples = 100000;
  for (int i = 0; i < kSamples; ++i) {
    policy.Sample(rng, u);
    log_prob += policy.LogProb(u) / kSamples;
    for (size_t k = 0; k < 2; ++k) {
      sum[k] += u[k] / kSamples;
      squares[k] += u[k] * u[k] / kSamples;
    }
  }
  for (size_t k = 0; k < 2; ++k) {
    EXPECT_NEAR(sum[k], mean[k], 0.013 * std[k]);  // 4 standard errors
    EXPECT_NEAR(squares[k] - mean[k] * mean[k], std[k] * std[k], 0.04 * std[k] * std[k]);
  }
  EXPECT_NEAR(policy.Entropy(), -log_prob, 0.013);
  const double two_pi_e = 2 * std::numbers::pi * std::numbers::e;
  EXPECT_NEAR(policy.Entropy(), std::log(two_pi_e), 1e-12);  // because σ₁ σ₂ = 1
}

TEST(DiagonalGaussian, GradientsOfTheLossAreThoseOfFiniteDifferences) {
  const std::vector<double> u{0.9, -1.7};
  for (const double advantage : {1.3, -0.7}) {
    std::vector<double> mean{0.7, -2}, log_std{-0.4, 0.3};
    const auto loss = [&](LossTerm<double>* term) {
      const std::vector<double> std{std::exp(log_std[0]), std::exp(log_std[1])};
      const DiagonalGaussian<double> policy{mean, log_std, std};
      const LossTerm<double> clipped =
          ClippedLoss(std::exp(policy.LogProb(u) + 2.3), advantage, 0.9);
      if (term != nullptr) *term = clipped;
      return clipped.loss - 0.05 * policy.Entropy();
    };
    LossTerm<double> term{};
    loss(&term);
    ASSERT_NE(term.gradient, 0);
    const std::vector<double> std{std::exp(log_std[0]), std::exp(log_std[1])};
    std::vector<double> dmean(2), dlog_std{10, 20};  // Backward adds to dlog_std
    DiagonalGaussian<double>{mean, log_std, std}.Backward(u, term.gradient, -0.05, dmean, dlog_std);
    for (size_t k = 0; k < 2; ++k) {
      const auto f = [&] { return loss(nullptr); };
      EXPECT_NEAR(dmean[k], Numeric(mean[k], f), 1e-7);
      EXPECT_NEAR(dlog_std[k] - (k == 0 ? 10 : 20), Numeric(log_std[k], f), 1e-7);
    }
  }
}

TEST(Categorical, SamplesFollowSoftmax) {
  const std::vector<double> logits{1000, 1001, 998};  // large logits do not overflow
  std::vector<double> p(3);
  const Categorical<double> policy(logits, p);
  const double sum = 1 + std::exp(1) + std::exp(-2);
  const std::vector<double> expected{1 / sum, std::exp(1) / sum, std::exp(-2) / sum};
  Rng rng(1, "samples");
  std::vector<double> share(3);
  for (int i = 0; i < 100000; ++i) share[policy.Sample(rng)] += 1e-5;
  double entropy = 0;
  for (size_t k = 0; k < 3; ++k) {
    EXPECT_NEAR(std::exp(policy.LogProb(k)), expected[k], 1e-12);
    EXPECT_NEAR(share[k], expected[k], 0.007);  // more than 4 standard errors
    entropy -= expected[k] * std::log(expected[k]);
  }
  EXPECT_NEAR(policy.Entropy(), entropy, 1e-12);
}

TEST(Categorical, GradientsOfTheLossAreThoseOfFiniteDifferences) {
  for (const double advantage : {1.3, -0.7}) {
    std::vector<double> logits{0.2, -0.5, 1.1, 0.4}, p(4), dlogits(4);
    const auto loss = [&] {
      const Categorical<double> policy(logits, p);
      return ClippedLoss(std::exp(policy.LogProb(2) + 1), advantage, 0.9).loss -
             0.05 * policy.Entropy();
    };
    std::vector<double> numeric;
    for (double& x : logits) numeric.push_back(Numeric(x, loss));
    const Categorical<double> policy(logits, p);
    const LossTerm<double> term = ClippedLoss(std::exp(policy.LogProb(2) + 1), advantage, 0.9);
    ASSERT_NE(term.gradient, 0);
    policy.Backward(2, term.gradient, -0.05, dlogits);
    for (size_t k = 0; k < 4; ++k) EXPECT_NEAR(dlogits[k], numeric[k], 1e-7);
  }
}

}  // namespace
}  // namespace upswing
