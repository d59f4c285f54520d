#include "nn/linear.h"

#include <gtest/gtest.h>

#include <cmath>
#include <numeric>
#include <vector>

#include "core/aligned.h"
#include "core/rng.h"

namespace upswing {
namespace {

AlignedVector<double> RandomNumbers(size_t n, const char* stream) {
  Rng rng(7, stream);
  AlignedVector<double> values(n);
  for (double& x : values) x = rng.Normal();
  return values;
}

/// Sizes that are and are not multiples of a vector register, down to one.
class LinearTest : public ::testing::TestWithParam<std::array<int, 3>> {
 protected:
  int B() const { return GetParam()[0]; }
  int in() const { return GetParam()[1]; }
  int out() const { return GetParam()[2]; }
  size_t size(int rows, int cols) const {
    return static_cast<size_t>(rows) * static_cast<size_t>(cols);
  }
};

TEST_P(LinearTest, ForwardAndBackwardMatchTheirDefinitions) {
  auto x = RandomNumbers(size(B(), in()), "x");
  auto w = RandomNumbers(size(out(), in()), "w");
  auto b = RandomNumbers(size(1, out()), "b");
  auto dy = RandomNumbers(size(B(), out()), "dy");
  AlignedVector<double> y(dy.size()), dw(w.size()), db(b.size()), dx(x.size());
  const Matrix<double> X(x, B(), in()), W(w, out(), in()), Y(y, B(), out()), DY(dy, B(), out()),
      DW(dw, out(), in()), DX(dx, B(), in());
  LinearForward<double>(X, W, b, Y);
  LinearBackward<double>(X, W, DY, DW, db, DX);

  // The sums in another order differ by rounding: n terms of size ~1.
  const double tolerance = 1e-12;
  for (int i = 0; i < B(); ++i) {
    for (int o = 0; o < out(); ++o) {
      double sum = b[static_cast<size_t>(o)];
      for (int k = 0; k < in(); ++k) sum += X(i, k) * W(o, k);
      ASSERT_NEAR(Y(i, o), sum, tolerance);
    }
    for (int k = 0; k < in(); ++k) {
      double sum = 0;
      for (int o = 0; o < out(); ++o) sum += DY(i, o) * W(o, k);
      ASSERT_NEAR(DX(i, k), sum, tolerance);
    }
  }
  for (int o = 0; o < out(); ++o) {
    double bias = 0;
    for (int i = 0; i < B(); ++i) bias += DY(i, o);
    ASSERT_NEAR(db[static_cast<size_t>(o)], bias, tolerance);
    for (int k = 0; k < in(); ++k) {
      double sum = 0;
      for (int i = 0; i < B(); ++i) sum += DY(i, o) * X(i, k);
      ASSERT_NEAR(DW(o, k), sum, tolerance);
    }
  }
}

INSTANTIATE_TEST_SUITE_P(Sizes, LinearTest,
                         ::testing::Values(std::array{1, 1, 1}, std::array{1, 8, 256},
                                           std::array{3, 5, 7}, std::array{32, 8, 9},
                                           std::array{33, 64, 1}, std::array{20, 65, 31}));

TEST(LayerNorm, RowsGetMeanZeroAndVarianceOneBeforeGainAndBias) {
  const int B = 3, n = 37;
  auto x = RandomNumbers(B * n, "layer norm");
  const auto raw = x;
  AlignedVector<double> gain(n, 2.0), bias(n, -1.0), inv_std(B), y(B * n);
  LayerNormForward<double>(Matrix<double>(x, B, n), gain, bias, inv_std, Matrix<double>(y, B, n));
  for (size_t i = 0; i < B; ++i) {
    double mean = 0, square = 0;
    for (size_t k = 0; k < n; ++k) mean += raw[i * n + k] / n;
    for (size_t k = 0; k < n; ++k) square += std::pow(raw[i * n + k] - mean, 2) / n;
    for (size_t k = 0; k < n; ++k) {
      const double normal = (raw[i * n + k] - mean) / std::sqrt(square + 1e-5);
      EXPECT_NEAR(x[i * n + k], normal, 1e-12);
      EXPECT_NEAR(y[i * n + k], 2 * normal - 1, 1e-12);
    }
  }
}

TEST(Kernels, ElementwiseOnes) {
  AlignedVector<double> y{-1, 0, 2}, dy{5, 6, 7};
  ReluForward(Matrix<double>(y, 1, 3));
  EXPECT_EQ(y, (AlignedVector<double>{0, 0, 2}));
  ReluBackward<double>(Matrix<double>(y, 1, 3), Matrix<double>(dy, 1, 3));
  EXPECT_EQ(dy, (AlignedVector<double>{0, 0, 7}));
  AddTo<double>(y, dy);
  EXPECT_EQ(dy, (AlignedVector<double>{0, 0, 9}));
  MoveTowards<double>(y, 0.25, dy);  // 9 + (2 - 9) / 4
  EXPECT_EQ(dy, (AlignedVector<double>{0, 0, 7.25}));
  EXPECT_EQ(SquaredNorm<double>(AlignedVector<double>{3, 4}), 25);
}

}  // namespace
}  // namespace upswing
