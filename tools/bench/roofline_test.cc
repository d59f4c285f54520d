#include "tools/bench/roofline.h"

#include <gtest/gtest.h>

#include "base/aligned.h"
#include "base/simd.h"

namespace upswing {
namespace {

class RooflineTest : public ::testing::TestWithParam<std::string> {
 protected:
  void SetUp() override { UseSimdPath(GetParam()); }
  void TearDown() override { UseSimdPath(SimdPaths().front()); }
};
INSTANTIATE_TEST_SUITE_P(Paths, RooflineTest, ::testing::ValuesIn(SimdPaths()),
                         [](const auto& info) { return info.param; });

TEST_P(RooflineTest, MultiplyAddChainsCountTheirOperations) {
  // On every chain and from any start, x ← 0.75 x + 0.25 converges to 1.
  float result = 0;
  const int64_t rounds = 100;
  const int64_t chains = MultiplyAddChains(rounds, result) / rounds;
  EXPECT_GE(chains, 12);
  EXPECT_NEAR(result, static_cast<float>(chains), 1e-4F * static_cast<float>(chains));
}

TEST_P(RooflineTest, TriadAddsTheRightNumbers) {
  AlignedVector<float> a(48), b(48), c(48);
  for (size_t i = 0; i < b.size(); ++i) {
    b[i] = static_cast<float>(i) / 7;
    c[i] = 1 / static_cast<float>(i + 1);
  }
  Triad(b, c, 0.5F, a);
  // Halving is exact, so only one rounding remains, with or without a fused multiply-add.
  for (size_t i = 0; i < a.size(); ++i) EXPECT_EQ(a[i], b[i] + 0.5F * c[i]);
}

}  // namespace
}  // namespace upswing
