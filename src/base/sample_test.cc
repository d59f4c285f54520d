#include "base/sample.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>

namespace upswing {
namespace {

TEST(Sample, WilsonIntervalMatchesPublishedValues) {
  // Newcombe (1998), Statistics in Medicine 17, Table I, method 3: 81/263, 15/148, 0/20, 1/29.
  const struct {
    int64_t x, n;
    double low, high;
  } kCases[] = {{81, 263, 0.2553, 0.3662},
                {15, 148, 0.0624, 0.1605},
                {0, 20, 0, 0.1611},
                {1, 29, 0.0061, 0.1718}};
  for (const auto& c : kCases) {
    EXPECT_NEAR(WilsonInterval(c.x, c.n).low, c.low, 5e-5);
    EXPECT_NEAR(WilsonInterval(c.x, c.n).high, c.high, 5e-5);
  }
  EXPECT_NEAR(WilsonInterval(100, 100).high, 1, 1e-15);
}

TEST(Sample, QuartilesAndMomentsByHand) {
  const Quartiles q = QuartilesOf({5, 1, 3, 2, 4});
  EXPECT_EQ(q.low, 2);
  EXPECT_EQ(q.median, 3);
  EXPECT_EQ(q.high, 4);
  EXPECT_EQ(QuartilesOf({1, 2}).median, 1.5);
  EXPECT_EQ(QuartilesOf({}).median, 0);
  const Moments m = MomentsOf(std::vector<double>{2, 4, 4, 4, 5, 5, 7, 9});
  EXPECT_EQ(m.mean, 5);
  EXPECT_NEAR(m.deviation, std::sqrt(32.0 / 7), 1e-15);
}

TEST(Sample, QuartilesOfASampleThatReachesInfinity) {
  constexpr double kInf = std::numeric_limits<double>::infinity();
  EXPECT_EQ(QuartilesOf({kInf, 1, 2}).median, 2);
  EXPECT_EQ(QuartilesOf({kInf, 1, 2}).high, kInf);  // halfway from 2 to infinity
  EXPECT_EQ(QuartilesOf({kInf, 1, 2, kInf}).median, kInf);
  EXPECT_EQ(QuartilesOf({kInf, kInf}).low, kInf);
}

}  // namespace
}  // namespace upswing
