#include "rl/value_bins.h"

#include <gtest/gtest.h>

#include <cmath>

#include "base/rng.h"

namespace upswing {
namespace {

std::vector<float> RandomLogits(size_t count) {
  Rng rng(1, "logits");
  std::vector<float> logits(count);
  for (float& x : logits) x = static_cast<float>(2 * rng.Normal());
  return logits;
}

TEST(ValueBins, WithoutBinsTheOutputIsTheValue) {
  const ValueBins bins(0, 0, 0);
  EXPECT_EQ(bins.outputs(), 1);
  const std::vector<float> output{3};
  std::vector<float> gradient(1);
  EXPECT_EQ(bins.Value(output), 3);
  EXPECT_EQ(bins.Loss(output, 1, gradient), 2);  // (3 - 1)² / 2
  EXPECT_EQ(gradient[0], 2);
  bins.ValueGradient(output, 0.5F, gradient);
  EXPECT_EQ(gradient[0], 0.5F);
}

TEST(ValueBins, TheBestLogitsStandForTheTarget) {
  // Cross-entropy is smallest where the softmax is the target's histogram. The mean of the
  // histogram is the target.
  const ValueBins bins(40, -4, 16);
  for (const float target : {-2.0F, 0.3F, 7.77F, 13.0F}) {
    std::vector<float> logits(40), gradient(40);
    for (int i = 0; i < 20000; ++i) {
      bins.Loss(logits, target, gradient);
      for (size_t k = 0; k < 40; ++k) logits[k] -= 2 * gradient[k];
    }
    EXPECT_NEAR(bins.Value(logits), target, 0.02) << target;
  }
}

TEST(ValueBins, GradientsAreThoseOfFiniteDifferences) {
  const ValueBins bins(11, -1, 10);
  const std::vector<float> logits = RandomLogits(11);
  for (const float target : {-5.0F, 0.2F, 4.4F, 30.0F}) {
    std::vector<float> gradient(11), value_gradient(11), unused(11);
    bins.Loss(logits, target, gradient);
    bins.ValueGradient(logits, 1, value_gradient);
    constexpr float kStep = 5e-3F;
    for (size_t k = 0; k < 11; ++k) {
      std::vector<float> up = logits, down = logits;
      up[k] += kStep;
      down[k] -= kStep;
      EXPECT_NEAR(gradient[k],
                  (bins.Loss(up, target, unused) - bins.Loss(down, target, unused)) / (2 * kStep),
                  2e-3);
      EXPECT_NEAR(value_gradient[k], (bins.Value(up) - bins.Value(down)) / (2 * kStep), 2e-3);
    }
  }
}

}  // namespace
}  // namespace upswing
