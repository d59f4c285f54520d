#include "nn/adam.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>

#include "base/error.h"

namespace upswing {
namespace {

/// Makes one step without targets.
void Step(Adam& adam, const AlignedVector<float>& gradient, double learning_rate, double max_norm,
          AlignedVector<float>& p) {
  double squares = 0;
  for (const float g : gradient) squares += static_cast<double>(g) * g;
  ThreadPool pool(1);
  AlignedVector<float> target(p.size());
  adam.Step({learning_rate, std::sqrt(squares), max_norm, 0.0}, gradient, p, target, pool);
}

TEST(Adam, TakesAnotherEpsilonAndNeedsNoTarget) {
  // Both bias corrections make the first step learning rate · g / (|g| + ε).
  Adam adam(1, 0.5);
  AlignedVector<float> p{1.0F};
  const AlignedVector<float> gradient{2.0F};
  ThreadPool pool(1);
  adam.Step({0.1, 2.0, 1e9, 0.0}, gradient, p, {}, pool);
  EXPECT_NEAR(p[0], 1 - 0.1 * 2 / 2.5, 1e-6);
}

TEST(Adam, FollowsTheAlgorithmAsThePaperWritesIt) {
  // Reference: Kingma and Ba, Algorithm 1, in double, with explicit m̂ and v̂.
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
    Step(adam, gradient, 1e-2, 1e9, p);
    ASSERT_NEAR(p[0], expected, 1.2e-5);  // 200 roundings to float, 6e-8 each
  }
}

TEST(Adam, ClipsByTheGlobalNorm) {
  // A gradient of norm 5 that is clipped to 1 acts like that gradient divided by 5, also in later
  // steps.
  Adam clipped(2), plain(2);
  AlignedVector<float> p{0, 0}, q{0, 0};
  Step(clipped, {3, 4}, 0.1, 1, p);
  Step(plain, {0.6F, 0.8F}, 0.1, 1e9, q);
  Step(clipped, {0.1F, 0}, 0.1, 1, p);
  Step(plain, {0.1F, 0}, 0.1, 1e9, q);
  EXPECT_NEAR(p[0], q[0], 1e-7);
  EXPECT_NEAR(p[1], q[1], 1e-7);
}

TEST(Adam, AGradientThatIsNotFiniteChangesNothing) {
  for (const float bad :
       {std::numeric_limits<float>::quiet_NaN(), std::numeric_limits<float>::infinity()}) {
    Adam adam(2);
    AlignedVector<float> p{1, 2};
    EXPECT_THROW(Step(adam, {0, bad}, 0.1, 10, p), Error);
    EXPECT_EQ(p, (AlignedVector<float>{1, 2}));
  }
}

TEST(Adam, TargetsFollowAndThreadsChangeNoBit) {
  constexpr size_t kMany = 20000;  // several tasks
  AlignedVector<float> gradient(kMany, 0.25F), p(kMany, 1), target(kMany, 2), p2 = p,
                                                                              target2 = target;
  ThreadPool one(1), three(3);
  const Adam::Size size{0.1, 1, 10, 0.5};
  Adam(kMany).Step(size, gradient, p, target, one);
  Adam(kMany).Step(size, gradient, p2, target2, three);
  EXPECT_EQ(p, p2);
  EXPECT_EQ(target, target2);
  EXPECT_NEAR(p[kMany - 1], 0.9, 1e-6);  // the first step has the size of the learning rate
  EXPECT_NEAR(target[kMany - 1], 2 + 0.5 * (0.9 - 2), 1e-6);
}

}  // namespace
}  // namespace upswing
