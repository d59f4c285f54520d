#include <gtest/gtest.h>

#include "base/simd.h"
#include "tools/bench/bench.h"

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

}  // namespace
}  // namespace upswing
