#include "rl/representation.h"

#include <gtest/gtest.h>

#include <vector>

namespace upswing {
namespace {

TEST(FeatureRank, CountsDirections) {
  const std::vector<float> one{1, 2, 3, /**/ 2, 4, 6, /**/ -1, -2, -3};
  EXPECT_NEAR(FeatureRank({one.data(), 3, 3}), 1, 1e-9);
  const std::vector<float> three{2, 0, 0, /**/ 0, 2, 0, /**/ 0, 0, 2};
  EXPECT_NEAR(FeatureRank({three.data(), 3, 3}), 3, 1e-9);
  // Eigenvalues 4 and 1: 25 / 17.
  const std::vector<float> uneven{2, 0, /**/ 0, 1, /**/ 0, 0};
  EXPECT_NEAR(FeatureRank({uneven.data(), 3, 2}), 25.0 / 17, 1e-9);
  const std::vector<float> none(6);
  EXPECT_EQ(FeatureRank({none.data(), 3, 2}), 0);
}

TEST(DormantShare, CountsUnitsThatHardlyFire) {
  // The means are 1, 0.01, 0 and 2.99. The layer's mean is 1, so the threshold is 0.025.
  const std::vector<float> features{2, 0.02F, 0, 2.99F, /**/ 0, 0, 0, 2.99F};
  EXPECT_EQ(DormantShare({features.data(), 2, 4}), 0.5);
  const std::vector<float> none(8);
  EXPECT_EQ(DormantShare({none.data(), 2, 4}), 1);
}

}  // namespace
}  // namespace upswing
