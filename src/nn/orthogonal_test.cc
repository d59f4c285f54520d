#include "nn/orthogonal.h"

#include <gtest/gtest.h>

#include <vector>

namespace upswing {
namespace {

TEST(Orthogonal, RowsOrColumnsAreOrthogonalAndOfLengthGain) {
  for (const auto& [in, out] : {std::pair{3, 64}, {64, 64}, {64, 1}, {1, 5}, {70, 9}}) {
    Rng rng(1, "weights");
    std::vector<float> values(static_cast<size_t>(in) * static_cast<size_t>(out));
    const Matrix<float> w(values.data(), in, out);
    OrthogonalWeights(rng, 1.5, w);
    const bool rows = in <= out;
    const auto at = [&](int i, int k) { return rows ? w(i, k) : w(k, i); };
    for (int i = 0; i < std::min(in, out); ++i) {
      for (int j = 0; j <= i; ++j) {
        double product = 0;
        for (int k = 0; k < std::max(in, out); ++k) product += double{at(i, k)} * at(j, k);
        // The vectors are computed in double and rounded to float, with a relative error of 6e-8.
        EXPECT_NEAR(product, i == j ? 2.25 : 0, 3e-7) << in << " × " << out;
      }
    }
  }
}

TEST(Orthogonal, EachKindOfParameterHasItsOwnBeginning) {
  const Network network({3, {8, 8}, 2, true, Activation::kTanh});
  std::vector<float> parameters(network.num_parameters(), 9);
  Rng rng(1, "weights");
  InitializeOrthogonal(network, 0.01, rng, parameters);
  for (const ParameterBlock& block : network.blocks()) {
    double squares = 0;
    for (const float x : std::span(parameters).subspan(block.offset, block.size())) {
      squares += double{x} * x;
    }
    // Each orthonormal vector adds the gain squared to the sum of squares.
    const double vectors = std::min(block.in, block.out);
    const bool norm = block.name.ends_with("norm.weight");
    const double expected = block.in == 0                   ? (norm ? 8.0 : 0.0)
                            : block.name == "output.weight" ? 1e-4 * vectors
                                                            : 2 * vectors;
    EXPECT_NEAR(squares, expected, 1.2e-7 * expected) << block.name;
  }
}

}  // namespace
}  // namespace upswing
