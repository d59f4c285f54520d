#include "nn/orthogonal.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <vector>

namespace upswing {
namespace {

/// Makes `count` orthonormal vectors of `size` numbers each; count ≤ size.
std::vector<double> OrthonormalVectors(Rng& rng, int count, int size) {
  std::vector<double> values(static_cast<size_t>(count) * size);
  const Matrix<double> vectors(values.data(), count, size);
  for (int i = 0; i < count; ++i) {
    const std::span<double> v = vectors.row(i);
    for (double& x : v) x = rng.Normal();
    // Project twice: the second pass removes the rounding errors of the first.
    for (int pass = 0; pass < 2; ++pass) {
      for (int j = 0; j < i; ++j) {
        double along = 0;
        for (int k = 0; k < size; ++k) along += vectors(i, k) * vectors(j, k);
        for (int k = 0; k < size; ++k) vectors(i, k) -= along * vectors(j, k);
      }
    }
    double squares = 0;
    for (const double x : v) squares += x * x;
    for (double& x : v) x /= std::sqrt(squares);
  }
  return values;
}

}  // namespace

void OrthogonalWeights(Rng& rng, double gain, Matrix<float> w) {
  const bool rows = w.rows() <= w.cols();
  const int count = std::min(w.rows(), w.cols());
  const int size = std::max(w.rows(), w.cols());
  const std::vector<double> values = OrthonormalVectors(rng, count, size);
  const Matrix<const double> vectors(values.data(), count, size);
  for (int i = 0; i < w.rows(); ++i) {
    for (int j = 0; j < w.cols(); ++j) {
      w(i, j) = static_cast<float>(gain * (rows ? vectors(i, j) : vectors(j, i)));
    }
  }
}

void InitializeOrthogonal(const Network& network, double output_gain, Rng& rng,
                          std::span<float> parameters) {
  for (const ParameterBlock& block : network.blocks()) {
    const std::span<float> values = parameters.subspan(block.offset, block.size());
    if (block.in > 0) {
      const bool output = block.name == "output.weight";
      OrthogonalWeights(rng, output ? output_gain : std::numbers::sqrt2,
                        Matrix<float>(values, block.in, block.out));
    } else {
      std::ranges::fill(values, block.name.ends_with("norm.weight") ? 1.0F : 0.0F);
    }
  }
}

}  // namespace upswing
