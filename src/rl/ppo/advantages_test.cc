#include "rl/ppo/advantages.h"

#include <gtest/gtest.h>

#include <cmath>
#include <vector>

namespace upswing {
namespace {

/// Advantages of three steps of one environment with r = 1, 2, 3, V(s) = 10, 20, 30, V(s') = 21,
/// 31, 41. The arguments end the second step.
std::vector<float> Advantages(double gamma, double lambda, bool terminated, bool truncated) {
  const std::vector<float> reward{1, 2, 3}, value{10, 20, 30}, next_value{21, 31, 41};
  const std::vector<uint8_t> ends{0, terminated, 0}, cuts{0, truncated, 0};
  std::vector<float> advantage(3);
  GeneralizedAdvantages({{reward.data(), 3, 1},
                         {value.data(), 3, 1},
                         {next_value.data(), 3, 1},
                         {ends.data(), 3, 1},
                         {cuts.data(), 3, 1}},
                        gamma, lambda, {advantage.data(), 3, 1});
  return advantage;
}

void ExpectNear(const std::vector<float>& got, const std::vector<double>& expected) {
  ASSERT_EQ(got.size(), expected.size());
  for (size_t i = 0; i < got.size(); ++i) EXPECT_NEAR(got[i], expected[i], 1e-5) << i;
}

// With γ = 1/2: δ₀ = 1 + 10.5 - 10 = 1.5 and δ₂ = 3 + 20.5 - 30 = -6.5. δ₁ = 2 + 15.5 - 20 = -2.5,
// or without a future 2 - 20 = -18.

TEST(Advantages, OfAnEpisodeThatGoesOn) {
  ExpectNear(Advantages(0.5, 0.8, false, false),
             {1.5 + 0.4 * (-2.5 + 0.4 * -6.5), -2.5 + 0.4 * -6.5, -6.5});
}

TEST(Advantages, ATerminatedEpisodeHasNoFuture) {
  ExpectNear(Advantages(0.5, 0.8, true, false), {1.5 + 0.4 * -18, -18, -6.5});
}

TEST(Advantages, ATruncatedEpisodeHasTheValueOfItsLastObservationAndNoMore) {
  ExpectNear(Advantages(0.5, 0.8, false, true), {1.5 + 0.4 * -2.5, -2.5, -6.5});
}

TEST(Advantages, TerminationCountsWhereBothAreSet) {
  ExpectNear(Advantages(0.5, 0.8, true, true), {1.5 + 0.4 * -18, -18, -6.5});
}

TEST(Advantages, WithoutLambdaAreTheOneStepErrors) {
  ExpectNear(Advantages(0.5, 0, false, false), {1.5, -2.5, -6.5});
}

TEST(Advantages, WithLambdaOneAreReturnsMinusValues) {
  // Σ γᵏ r + γ³ V(s'), where V of each successor is the V of the next row.
  const std::vector<float> reward{1, 2, 3}, value{10, 20, 30}, next_value{20, 30, 41};
  const std::vector<uint8_t> none{0, 0, 0};
  std::vector<float> advantage(3);
  GeneralizedAdvantages({{reward.data(), 3, 1},
                         {value.data(), 3, 1},
                         {next_value.data(), 3, 1},
                         {none.data(), 3, 1},
                         {none.data(), 3, 1}},
                        0.5, 1, {advantage.data(), 3, 1});
  ExpectNear(advantage, {1 + 0.5 * 2 + 0.25 * 3 + 0.125 * 41 - 10, 2 + 0.5 * 3 + 0.25 * 41 - 20,
                         3 + 0.5 * 41 - 30});
}

TEST(Advantages, EnvironmentsDoNotTouchEachOther) {
  // Two environments, two steps: the first environment ends, the second goes on.
  const std::vector<float> reward{1, 1, 1, 1}, value{0, 0, 0, 0}, next_value{0, 0, 8, 8};
  const std::vector<uint8_t> ends{1, 0, 0, 0}, none(4);
  std::vector<float> advantage(4);
  GeneralizedAdvantages({{reward.data(), 2, 2},
                         {value.data(), 2, 2},
                         {next_value.data(), 2, 2},
                         {ends.data(), 2, 2},
                         {none.data(), 2, 2}},
                        0.5, 1, {advantage.data(), 2, 2});
  ExpectNear(advantage, {1, 1 + 0.5 * 5, 5, 5});
}

TEST(Advantages, StandardizedOnesHaveMeanZeroAndDeviationOne) {
  std::vector<float> values{1, 2, 3, 4};
  Standardize(values);
  const double unit = 1 / std::sqrt(1.25);
  ExpectNear(values, {-1.5 * unit, -0.5 * unit, 0.5 * unit, 1.5 * unit});
  std::vector<float> equal{7, 7};
  Standardize(equal);
  ExpectNear(equal, {0, 0});
}

TEST(Advantages, ExplainedVariance) {
  const std::vector<float> target{1, 2, 3, 4}, shifted{2, 3, 4, 5}, constant{9, 9, 9, 9},
      half{0.5F, 1, 1.5F, 2};
  EXPECT_NEAR(ExplainedVariance(target, shifted), 1, 1e-12);
  EXPECT_NEAR(ExplainedVariance(target, constant), 0, 1e-12);
  EXPECT_NEAR(ExplainedVariance(target, half), 0.75, 1e-12);
  EXPECT_EQ(ExplainedVariance(constant, target), 0);
}

}  // namespace
}  // namespace upswing
