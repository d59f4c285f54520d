#include "nn/linear.h"

#include <gtest/gtest.h>

#include <cmath>
#include <cstring>
#include <limits>
#include <string>
#include <tuple>
#include <vector>

#include "base/aligned.h"
#include "base/rng.h"
#include "base/simd.h"
#include "nn/testing.h"

namespace upswing {
namespace {

constexpr double kEpsilon = std::numeric_limits<Real>::epsilon();

size_t Size(int rows, int cols) { return static_cast<size_t>(rows) * static_cast<size_t>(cols); }

/// Compares each kernel with its definition as plain loops in double. It runs on each instruction
/// set of this machine, in the number type of this build (nn/real.h). The test parameter is the gap
/// after each row of a table, in numbers. Without gaps, a sanitizer detects accesses beyond the
/// last row.
class KernelTest : public ::testing::TestWithParam<std::tuple<std::string, int>> {
 public:
  static int Gap() { return std::get<1>(GetParam()); }

 protected:
  void SetUp() override { UseSimdPath(std::get<0>(GetParam())); }
  void TearDown() override { UseSimdPath(SimdPaths().front()); }
};
INSTANTIATE_TEST_SUITE_P(Paths, KernelTest,
                         ::testing::Combine(::testing::ValuesIn(SimdPaths()),
                                            ::testing::Values(3, 0)),
                         [](const auto& info) {
                           const bool gaps = std::get<1>(info.param) > 0;
                           return std::get<0>(info.param) + (gaps ? "_gaps" : "_no_gaps");
                         });

/// A matrix that owns its numbers. The gap after each row holds large numbers, which make a read
/// from the gap visible. The destructor checks that the gaps still have the same bits.
struct Table {
  AlignedVector<Real> values;
  Matrix<Real> view;
  AlignedVector<Real> before;  // earlier copy of `values`; only its gaps have a meaning

  Table(int rows, int cols, const char* stream)
      : values(Size(rows, cols + KernelTest::Gap())),
        view(values.data(), rows, cols, cols + KernelTest::Gap()) {
    Rng rng(7, stream);
    for (Real& x : values) x = static_cast<Real>(rng.Normal());
    FillGaps([&] { return static_cast<Real>(1e30 * (1 + rng.Uniform())); });
  }
  Table(const Table&) = delete;
  Table& operator=(const Table&) = delete;
  ~Table() {
    for (int row = 0; row < view.rows(); ++row) {
      const std::span<const Real> gap = GapBehind(row);
      const Real* expected = before.data() + (gap.data() - values.data());
      EXPECT_EQ(std::memcmp(gap.data(), expected, gap.size_bytes()), 0)
          << "written behind row " << row << " of " << view.rows() << " × " << view.cols();
    }
  }

  operator Matrix<const Real>() const { return view; }  // NOLINT(google-explicit-constructor)
  std::span<const Real> row() const { return view.row(0); }
  std::span<Real> row() { return view.row(0); }

 protected:
  template <typename Number>
  void FillGaps(const Number& number) {
    for (int row = 0; row < view.rows(); ++row) {
      for (Real& x : GapBehind(row)) x = number();
    }
    before = values;
  }

 private:
  std::span<Real> GapBehind(int row) const {
    return {view.row(row).data() + view.cols(), static_cast<size_t>(KernelTest::Gap())};
  }
};

/// A table for reading only. Its gaps hold NaN, so that even a product of a gap with 0 is visible.
/// Gaps of other tables hold ordinary numbers, because NaN would hide a write of a computed NaN.
struct Input : Table {
  Input(int rows, int cols, const char* stream) : Table(rows, cols, stream) {
    FillGaps([] { return std::numeric_limits<Real>::quiet_NaN(); });
  }
};

/// Bound on the rounding error of a sum of n products of numbers of size 1.
double Tolerance(int n) { return 4 * kEpsilon * (n + 8.0); }

void CheckLinear(int B, int in, int out) {
  SCOPED_TRACE(::testing::Message() << B << " × " << in << " × " << out);
  const Input x(B, in, "x"), w(in, out, "w"), b(1, out, "b"), dy(B, out, "dy"), gate(B, in, "gate"),
      w_transposed(out, in, "wt");
  Table y(B, out, ""), y_relu(B, out, ""), dx(B, in, ""), dw(in, out, "");
  LinearForward(x, w, b.row(), false, y.view);
  LinearForward(x, w, b.row(), true, y_relu.view);
  LinearBackwardInput(dy, w_transposed, gate, dx.view);
  Table db(1, out, ""), row_sum(1, out, "");
  LinearBackwardWeight(x, dy, dw.view, db.row());
  SumRows(dy, row_sum.row());
  ASSERT_TRUE(std::ranges::equal(db.row(), row_sum.row()));
  for (int i = 0; i < B; ++i) {
    for (int o = 0; o < out; ++o) {
      double sum = b.view(0, o);
      for (int k = 0; k < in; ++k) sum += static_cast<double>(x.view(i, k)) * w.view(k, o);
      ASSERT_NEAR(y.view(i, o), sum, Tolerance(in));
      ASSERT_EQ(y_relu.view(i, o), std::max(y.view(i, o), Real{0}));
    }
    for (int k = 0; k < in; ++k) {
      double sum = 0;
      for (int o = 0; o < out; ++o) {
        sum += static_cast<double>(dy.view(i, o)) * w_transposed.view(o, k);
      }
      ASSERT_NEAR(dx.view(i, k), gate.view(i, k) > 0 ? sum : 0, Tolerance(out));
    }
  }
  for (int k = 0; k < in; ++k) {
    for (int o = 0; o < out; ++o) {
      double sum = 0;
      for (int i = 0; i < B; ++i) sum += static_cast<double>(x.view(i, k)) * dy.view(i, o);
      ASSERT_NEAR(dw.view(k, o), sum, Tolerance(B));
    }
  }
}

TEST_P(KernelTest, LinearLayersMatchTheirDefinitions) {
  // Sizes down to 1. Some are multiples of tiles and registers; some have few outputs.
  const std::vector<std::tuple<int, int, int>> sizes{
      {1, 1, 1},   {1, 8, 256},  {2, 3, 130}, {3, 5, 7},  {7, 64, 31}, {15, 8, 9},
      {33, 65, 1}, {32, 12, 64}, {37, 68, 2}, {16, 4, 3}, {41, 8, 4}};
  for (const auto& [B, in, out] : sizes) CheckLinear(B, in, out);
}

/// Requires each row of a batch to have the bits of a batch of only that row.
void CheckRows(int B, int in, int out, bool relu) {
  const Input x(B, in, "x"), w(in, out, "w"), b(1, out, "b");
  Table together(B, out, ""), alone(1, out, "");
  LinearForward(x, w, b.row(), relu, together.view);
  for (int i = 0; i < B; ++i) {
    LinearForward(x.view.Rows(i, 1), w, b.row(), relu, alone.view);
    ASSERT_TRUE(std::ranges::equal(alone.view.row(0), together.view.row(i))) << i;
  }
  Table dw(in, out, ""), dw_rows(5, out, "");
  LinearBackwardWeight(x, together, dw.view);
  LinearBackwardWeight(x.view.Cols(11, 5), together, dw_rows.view);
  for (int k = 0; k < 5; ++k) {
    ASSERT_TRUE(std::ranges::equal(dw_rows.view.row(k), dw.view.row(11 + k)));
  }
}

TEST_P(KernelTest, ARowDoesNotDependOnItsNeighbours) {
  // Require equal bits; otherwise results would depend on the number of threads.
  CheckRows(37, 70, 45, true);
  CheckRows(32, 64, 64, true);
  for (int out = 1; out <= 5; ++out) CheckRows(37, 64, out, false);
}

TEST_P(KernelTest, TransposeTransposes) {
  for (const auto& [rows, cols] :
       std::vector<std::pair<int, int>>{{1, 1}, {1, 9}, {9, 1}, {4, 8}, {9, 256}, {37, 6}}) {
    const Input x(rows, cols, "x");
    Table y(cols, rows, "");
    Transpose(x, y.view);
    for (int r = 0; r < rows; ++r) {
      for (int c = 0; c < cols; ++c) ASSERT_EQ(y.view(c, r), x.view(r, c));
    }
  }
}

TEST_P(KernelTest, SumsMatchTheirDefinitions) {
  for (const int n : {1, 7, 16, 37, 300}) {
    const Input x(9, n, "x"), y(9, n, "y");
    Table sum(1, n, ""), along(1, n, "");
    SumRows(x, sum.row());
    LayerNormBackwardGain(x, y, along.row());
    double squares = 0;
    for (int k = 0; k < n; ++k) {
      double column = 0, products = 0;
      for (int i = 0; i < 9; ++i) {
        column += x.view(i, k);
        products += double{x.view(i, k)} * y.view(i, k);
      }
      ASSERT_NEAR(sum.view(0, k), column, Tolerance(9));
      ASSERT_NEAR(along.view(0, k), products, Tolerance(9));
      squares += double{x.view(0, k)} * x.view(0, k);
    }
    ASSERT_NEAR(SquaredNorm(x.row()), squares, Tolerance(n));
  }
}

TEST_P(KernelTest, LayerNormRowsGetMeanZeroAndVarianceOneBeforeGainAndBias) {
  // Roundings of numbers of size 1, times up to 1 / sqrt(var + 1e-5). A row of one number has
  // var = 0.
  constexpr double kTolerance = 4500 * kEpsilon;
  for (const int n : {1, 5, 37, 256}) {
    const int B = 3;
    const bool relu = n != 37;
    Table x(B, n, "layer norm"), y(B, n, "");
    const Input raw(B, n, "layer norm"), gain(1, n, "gain"), bias(1, n, "bias");
    Table inv_std(1, B, "");
    LayerNormForward(x.view, gain.row(), bias.row(), inv_std.row(), relu, y.view);
    for (int i = 0; i < B; ++i) {
      double mean = 0, square = 0;
      for (int k = 0; k < n; ++k) mean += raw.view(i, k) / n;
      for (int k = 0; k < n; ++k) square += std::pow(raw.view(i, k) - mean, 2) / n;
      for (int k = 0; k < n; ++k) {
        const double normal = (raw.view(i, k) - mean) / std::sqrt(square + 1e-5);
        ASSERT_NEAR(x.view(i, k), normal, kTolerance);
        const double expected = gain.view(0, k) * normal + bias.view(0, k);
        ASSERT_NEAR(y.view(i, k), relu ? std::max(0.0, expected) : expected, kTolerance);
      }
    }
  }
}

#ifdef UPSWING_DOUBLE  // in float, roundings hide what a finite difference shows
TEST_P(KernelTest, LayerNormGradientMatchesFiniteDifferences) {
  // f = Σ dy · (gain · x̂ + bias)
  const int n = 21;
  const double h = 1e-5;
  const Input x(1, n, "x"), gain(1, n, "gain"), bias(1, n, "bias"), dy(1, n, "dy");
  AlignedVector<double> inv_std(1);
  const auto f = [&](int k, double step) {
    Table moved(1, n, "x"), y(1, n, "");
    moved.view(0, k) += step;
    LayerNormForward(moved.view, gain.row(), bias.row(), inv_std, false, y.view);
    double sum = 0;
    for (int i = 0; i < n; ++i) sum += dy.view(0, i) * y.view(0, i);
    return sum;
  };
  Table x_hat(1, n, "x"), y(1, n, ""), dx(1, n, "");
  LayerNormForward(x_hat.view, gain.row(), bias.row(), inv_std, false, y.view);
  LayerNormBackwardInput(x_hat, gain.row(), inv_std, dy, dx.view);
  for (int k = 0; k < n; ++k) {
    // errors: rounding 1e-15 · 10 / h, truncation h²
    EXPECT_NEAR(dx.view(0, k), (f(k, h) - f(k, -h)) / (2 * h), 1e-9);
  }
}
#endif

TEST_P(KernelTest, TanhAndItsBackwardPass) {
  constexpr Real tolerance = 4 * kEpsilon;
  const Real infinity = std::numeric_limits<Real>::infinity();
  // Single numbers and whole registers: near 0, where tanh bends, and where it is ±1.
  std::vector<Real> x{Real(1e-30), Real(-1e-5), Real(0.3),  Real(-0.5), Real(1),  Real(-4),
                      Real(9),     Real(-19),   Real(1e30), -infinity,  0,        Real(0.02),
                      Real(-0.9),  Real(0.55),  Real(7.5),  Real(-2),   Real(0.1)};
  for (size_t n = 1; n <= x.size(); ++n) {
    std::vector<Real> y(x.begin(), x.begin() + static_cast<ptrdiff_t>(n)), dy(n, Real{3});
    Tanh(y);
    TanhBackward(y, dy);
    for (size_t i = 0; i < n; ++i) {
      const Real expected = std::tanh(x[i]);
      ASSERT_NEAR(y[i], expected, tolerance * std::abs(expected)) << x[i];
      ASSERT_NEAR(dy[i], 3 * (1 - y[i] * y[i]), 6 * tolerance) << x[i];
    }
  }
  std::vector<Real> nan{std::numeric_limits<Real>::quiet_NaN()};
  Tanh(nan);
  EXPECT_TRUE(std::isnan(nan[0]));
}

TEST_P(KernelTest, SquashedSamplesFollowTheirDefinition) {
  constexpr Real tolerance = 4 * kEpsilon;
  constexpr size_t kMost = 37;
  Rng rng(3, "samples");
  std::vector<Real> mean, log_std, epsilon;
  for (size_t i = 0; i < kMost; ++i) {
    mean.push_back(static_cast<Real>(i % 3 == 0 ? 20 * rng.Normal() : rng.Normal()));
    log_std.push_back(static_cast<Real>(rng.Uniform(kLogStdLow, kLogStdHigh)));
    epsilon.push_back(static_cast<Real>(rng.Normal()));
  }
  mean[5] = epsilon[5] = 0;
  for (size_t n = 1; n <= kMost; ++n) {
    std::vector<Real> deviation(n), action(n), log_prob(n);
    const auto part = [&](const std::vector<Real>& x) { return std::span<const Real>(x).first(n); };
    SquashSamples(part(mean), part(log_std), part(epsilon), deviation, action, log_prob);
    for (size_t i = 0; i < n; ++i) {
      const auto policy = Gaussian<Real>::From(mean[i], log_std[i]);
      const Squashed<Real> expected = Squash(policy, epsilon[i]);
      ASSERT_NEAR(deviation[i], policy.std, tolerance * policy.std);
      ASSERT_NEAR(action[i], expected.action, tolerance) << mean[i];
      // ln π contains terms as large as 2 |u|.
      ASSERT_NEAR(log_prob[i], expected.log_prob,
                  tolerance * (4 + 4 * std::abs(mean[i]) + 4 * policy.std * std::abs(epsilon[i])));
    }
  }
}

TEST_P(KernelTest, AdamAndPolyakInOnePass) {
  const AdamConstants c{Real(0.5), Real(0.9), Real(0.99), Real(0.01), Real(1e-3), Real(0.25)};
  constexpr double kTolerance = 45 * kEpsilon;  // a few roundings of numbers of size 1 to 10
  for (const int n : {1, 3, 50}) {
    const Input g(1, n, "g"), m0(1, n, "m"), v0(1, n, "v"), p0(1, n, "p"), t0(1, n, "t");
    Table m(1, n, "m"), v(1, n, "v"), p(1, n, "p"), t(1, n, "t");
    const auto square = [](double x) { return x * x; };
    for (Real& x : v.row()) x *= x;
    AdamPolyakStep(c, g.row(), m.row(), v.row(), p.row(), t.row());
    for (int k = 0; k < n; ++k) {
      const double gradient = 0.5 * g.view(0, k);
      const double m_new = 0.9 * m0.view(0, k) + 0.1 * gradient;
      const double v_new = 0.99 * square(v0.view(0, k)) + 0.01 * square(gradient);
      const double p_new = p0.view(0, k) - 0.01 * m_new / (std::sqrt(v_new) + 1e-3);
      EXPECT_NEAR(m.view(0, k), m_new, kTolerance);
      EXPECT_NEAR(v.view(0, k), v_new, kTolerance);
      EXPECT_NEAR(p.view(0, k), p_new, kTolerance);
      EXPECT_NEAR(t.view(0, k), t0.view(0, k) + 0.25 * (p_new - t0.view(0, k)), kTolerance);
    }
  }
}

TEST_P(KernelTest, MomentsWithoutGradientEndAtZero) {
  const AdamConstants c{1, Real(0.9), Real(0.99), Real(0.01), Real(1e-8), 0};
  for (const int n : {1, 50}) {
    Table g(1, n, "g"), m(1, n, "m"), v(1, n, "v"), p(1, n, "p");
    std::ranges::fill(g.row(), Real(0));
    std::ranges::fill(m.row(), Real(-1.01) * kLeastMoment);
    std::ranges::fill(v.row(), Real(1.05) * kLeastMoment);
    std::ranges::fill(p.row(), Real(1));
    AdamPolyakStep(c, g.row(), m.row(), v.row(), p.row(), {});
    for (int k = 0; k < n; ++k) {
      EXPECT_EQ(m.view(0, k), 0);
      EXPECT_EQ(v.view(0, k), Real(0.99) * (Real(1.05) * kLeastMoment));
      EXPECT_EQ(p.view(0, k), 1);
    }
  }
}

}  // namespace
}  // namespace upswing
