#include "nn/adam.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>

#include "core/error.h"

namespace upswing {
namespace {

TEST(Adam, FollowsTheAlgorithmAsThePaperWritesIt) {
  // Kingma and Ba, Algorithm 1, in double, with m̂ and v̂ written out.
  Adam adam(1);
  AlignedVector<float> p{1.0F};
  double expected = 1.0, m = 0, v = 0;
  for (int t = 1; t <= 200; ++t) {
    const double g = std::sin(0.3 * t) + 0.1;
    m = 0.9 * m + 0.1 * g;
    v = 0.999 * v + 0.001 * g * g;
    const double m_hat = m / (1 - std::pow(0.9, t));
    const double v_hat = v / (1 - std::pow(0.999, t));
    expected -= 1e-2 * m_hat / (std::sqrt(v_hat) + 1e-8);
    const AlignedVector<float> gradient{static_cast<float>(g)};
    EXPECT_NEAR(adam.Step(gradient, 1e-2, 1e9, p), std::abs(g), 1e-6);
    ASSERT_NEAR(p[0], expected, 1.2e-5);  // 200 roundings to float, 6e-8 each
  }
}

TEST(Adam, ClipsByTheGlobalNorm) {
  // A gradient of norm 5 clipped to 1 acts like that gradient divided by 5, also in later steps.
  Adam clipped(2), plain(2);
  AlignedVector<float> p{0, 0}, q{0, 0};
  EXPECT_FLOAT_EQ(static_cast<float>(clipped.Step(AlignedVector<float>{3, 4}, 0.1, 1, p)), 5);
  plain.Step(AlignedVector<float>{0.6F, 0.8F}, 0.1, 1e9, q);
  clipped.Step(AlignedVector<float>{0.1F, 0}, 0.1, 1, p);
  plain.Step(AlignedVector<float>{0.1F, 0}, 0.1, 1e9, q);
  EXPECT_NEAR(p[0], q[0], 1e-7);
  EXPECT_NEAR(p[1], q[1], 1e-7);
}

TEST(Adam, AGradientThatIsNotFiniteChangesNothing) {
  for (const float bad :
       {std::numeric_limits<float>::quiet_NaN(), std::numeric_limits<float>::infinity()}) {
    Adam adam(2);
    AlignedVector<float> p{1, 2};
    EXPECT_THROW(adam.Step(AlignedVector<float>{0, bad}, 0.1, 10, p), Error);
    EXPECT_EQ(p, (AlignedVector<float>{1, 2}));
  }
}

}  // namespace
}  // namespace upswing
