#include "nn/q_network.h"

#include <gtest/gtest.h>

#include "core/error.h"

namespace upswing {
namespace {

TEST(QNetwork, ParameterCountsOfThePublishedNetworks) {
  EXPECT_EQ(QNetwork<float>({8, 9, {256, 256}, 0, false, false}).num_parameters(),
            8U * 256 + 256 + 256 * 256 + 256 + 256 * 9 + 9);
  EXPECT_EQ(QNetwork<float>({8, 9, {256, 256}, 128, true, false}).num_parameters(),
            8U * 256 + 256 + 256 * 256 + 256 + 2 * (256 * 128 + 128) + 128 + 1 + 128 * 9 + 9);
}

TEST(QNetwork, ParametersHaveTheNamesAndTheOrderOfPolicyFiles) {
  const auto names = [](const QNetworkShape& shape) {
    std::vector<std::string> all;
    const QNetwork<float> network(shape);
    for (const ParameterBlock& block : network.blocks()) all.push_back(block.name);
    return all;
  };
  EXPECT_EQ(names({8, 9, {7, 6}, 0, false, false}),
            (std::vector<std::string>{"feature.0.weight", "feature.0.bias", "feature.1.weight",
                                      "feature.1.bias", "output.weight", "output.bias"}));
  EXPECT_EQ(names({8, 9, {7}, 5, true, true}),
            (std::vector<std::string>{"feature.0.weight", "feature.0.bias", "feature.0.norm.weight",
                                      "feature.0.norm.bias", "streams.weight", "streams.bias",
                                      "value.weight", "value.bias", "advantage.weight",
                                      "advantage.bias"}));
}

TEST(QNetwork, DuelingIsTheValuePlusAdvantagesAboutTheirMean) {
  // All weights zero: V and A are the last biases. V = 3, A = 1, 2, 6 → Q = 3 + (-2, -1, 3).
  const QNetwork<double> network({2, 3, {4}, 2, true, false});
  AlignedVector<double> parameters(network.num_parameters());
  for (const ParameterBlock& block : network.blocks()) {
    if (block.name == "value.bias") parameters[block.offset] = 3;
    if (block.name == "advantage.bias") {
      parameters[block.offset] = 1;
      parameters[block.offset + 1] = 2;
      parameters[block.offset + 2] = 6;
    }
  }
  auto activations = network.MakeActivations(1, false);
  const AlignedVector<double> x{0.5, -0.5};
  AlignedVector<double> q(3);
  network.Forward({parameters}, Matrix<const double>(x.data(), 1, 2), {0, 1}, activations,
                  Matrix<double>(q, 1, 3));
  EXPECT_EQ(q, (AlignedVector<double>{1, 2, 6}));  // mean(Q) = 3 = V
  EXPECT_DOUBLE_EQ((q[0] + q[1] + q[2]) / 3, 3);
}

TEST(QNetwork, RefusesInvalidSizes) {
  EXPECT_THROW(QNetwork<float>({0, 9, {4}, 0, false, false}), Error);
  EXPECT_THROW(QNetwork<float>({8, 0, {4}, 0, false, false}), Error);
  EXPECT_THROW(QNetwork<float>({8, 9, {4}, 0, true, false}), Error);
  EXPECT_THROW(QNetwork<float>({8, 9, {4}, 2, false, false}), Error);
}

}  // namespace
}  // namespace upswing
