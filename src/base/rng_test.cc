#include "base/rng.h"

#include <gtest/gtest.h>

#include <cmath>
#include <set>

#include "base/testing.h"

namespace upswing {
namespace {

TEST(Rng, XoshiroMatchesItsReferenceCode) {
  // xoshiro256++ by Blackman and Vigna (public domain, prng.di.unimi.it), from state {1, 2, 3, 4}.
  const uint64_t kExpected[] = {41943041, 58720359, 3588806011781223, 3591011842654386,
                                9228616714210784205U};
  std::array<uint64_t, 4> state{1, 2, 3, 4};
  Rng rng(0, "any");
  SaveAndLoad(
      [&](const Archive& archive) {
        archive.Array("state", std::span<uint64_t>(state), kAnyNumber<uint64_t>);
      },
      [&](const Archive& archive) { rng.State(archive); });
  for (const uint64_t expected : kExpected) EXPECT_EQ(rng.Next(), expected);
}

TEST(Rng, StreamsDifferInSeedNameAndIndex) {
  std::set<uint64_t> first_numbers;
  for (const uint64_t seed : {0, 1, 2}) {
    for (const char* name : {"", "a", "b", "ab", "ba"}) {
      for (const uint64_t index : {0, 1, 97}) first_numbers.insert(Rng(seed, name, index).Next());
    }
  }
  EXPECT_EQ(first_numbers.size(), 3U * 5U * 3U);
  EXPECT_EQ(Rng(5, "x", 3).Next(), Rng(5, "x", 3).Next());
}

TEST(Rng, APairOfNormalsBeginsWithTheNormalAndItsNumbersAreIndependent) {
  Rng rng(3, "pair"), other(3, "pair");
  double sum[2]{}, square[2]{}, product = 0;
  constexpr int kPairs = 100000;
  for (int i = 0; i < kPairs; ++i) {
    const auto [a, b] = rng.NormalPair();
    ASSERT_EQ(a, other.Normal());
    sum[0] += a;
    sum[1] += b;
    square[0] += a * a;
    square[1] += b * b;
    product += a * b;
  }
  for (const int i : {0, 1}) {
    EXPECT_NEAR(sum[i] / kPairs, 0, 0.02);
    EXPECT_NEAR(square[i] / kPairs, 1, 0.03);
  }
  EXPECT_NEAR(product / kPairs, 0, 0.02);
}

TEST(Rng, UniformAndNormalHaveTheirMoments) {
  // Tolerances: five standard errors of the mean and of the mean square.
  constexpr int n = 200000;
  Rng rng(1, "moments");
  double uniform = 0, uniform2 = 0, normal = 0, normal2 = 0;
  for (int i = 0; i < n; ++i) {
    const double u = rng.Uniform();
    ASSERT_GE(u, 0);
    ASSERT_LT(u, 1);
    uniform += u / n;
    uniform2 += u * u / n;
    const double z = rng.Normal();
    normal += z / n;
    normal2 += z * z / n;
  }
  EXPECT_NEAR(uniform, 1.0 / 2, 5 * std::sqrt(1.0 / 12 / n));
  EXPECT_NEAR(uniform2, 1.0 / 3, 5 * std::sqrt(4.0 / 45 / n));
  EXPECT_NEAR(normal, 0, 5 * std::sqrt(1.0 / n));
  EXPECT_NEAR(normal2, 1, 5 * std::sqrt(2.0 / n));
}

TEST(Rng, BelowReachesEveryValueEvenly) {
  constexpr int n = 90000;
  std::array<int, 9> count{};
  Rng rng(2, "below");
  for (int i = 0; i < n; ++i) ++count.at(rng.Below(9));
  for (const int c : count) EXPECT_NEAR(c, n / 9.0, 5 * std::sqrt(n / 9.0));
}

}  // namespace
}  // namespace upswing
