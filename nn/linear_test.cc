#include "nn/linear.h"

#include <gtest/gtest.h>

#include <cmath>
#include <cstring>
#include <limits>
#include <string>
#include <tuple>
#include <vector>

#include "core/aligned.h"
#include "core/rng.h"
#include "core/simd.h"
#include "nn/gaussian.h"

namespace upswing {
namespace {

size_t Size(int rows, int cols) { return static_cast<size_t>(rows) * static_cast<size_t>(cols); }

/// Each kernel on each kind of vector instructions that this machine has, against its definition
/// as plain loops in double; with tables whose rows have a gap of so many numbers behind them, and
/// with tables that end with their last row, where a sanitizer sees what goes beyond.
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

/// A matrix that owns its numbers. The gap after each row holds large ones, which show if they are
/// read, and must have the same bits at the end of the table.
template <typename T>
struct Table {
  AlignedVector<T> values;
  Matrix<T> view;
  AlignedVector<T> before;  // as `values`; all but its gaps is without meaning

  Table(int rows, int cols, const char* stream)
      : values(Size(rows, cols + KernelTest::Gap())),
        view(values.data(), rows, cols, cols + KernelTest::Gap()) {
    Rng rng(7, stream);
    for (T& x : values) x = static_cast<T>(rng.Normal());
    FillGaps([&] { return static_cast<T>(1e30 * (1 + rng.Uniform())); });
  }
  Table(const Table&) = delete;
  Table& operator=(const Table&) = delete;
  ~Table() {
    for (int row = 0; row < view.rows(); ++row) {
      const std::span<const T> gap = GapBehind(row);
      const T* expected = before.data() + (gap.data() - values.data());
      EXPECT_EQ(std::memcmp(gap.data(), expected, gap.size_bytes()), 0)
          << "written behind row " << row << " of " << view.rows() << " × " << view.cols();
    }
  }

  // As a template's argument only this type can be deduced from.
  operator Matrix<const T>() const { return view; }  // NOLINT(google-explicit-constructor)
  std::span<const T> row() const { return view.row(0); }
  std::span<T> row() { return view.row(0); }

 protected:
  template <typename Number>
  void FillGaps(const Number& number) {
    for (int row = 0; row < view.rows(); ++row) {
      for (T& x : GapBehind(row)) x = number();
    }
    before = values;
  }

 private:
  std::span<T> GapBehind(int row) const {
    return {view.row(row).data() + view.cols(), static_cast<size_t>(KernelTest::Gap())};
  }
};

/// A table that is only read: its gaps are not a number, so that not even 0 times one goes unseen.
/// (Those of other tables are numbers, because what is computed with NaN may have the same bits.)
template <typename T>
struct Input : Table<T> {
  Input(int rows, int cols, const char* stream) : Table<T>(rows, cols, stream) {
    this->FillGaps([] { return std::numeric_limits<T>::quiet_NaN(); });
  }
};

/// Bound of the rounding error of a sum of n products of numbers of size 1.
template <typename T>
double Tolerance(int n) {
  return 4 * std::numeric_limits<T>::epsilon() * (n + 8.0);
}

template <typename T>
void CheckLinear(int B, int in, int out) {
  SCOPED_TRACE(::testing::Message() << B << " × " << in << " × " << out);
  const Input<T> x(B, in, "x"), w(in, out, "w"), b(1, out, "b"), dy(B, out, "dy"),
      gate(B, in, "gate"), w_transposed(out, in, "wt");
  Table<T> y(B, out, ""), y_relu(B, out, ""), dx(B, in, ""), dw(in, out, "");
  LinearForward<T>(x, w, b.row(), false, y.view);
  LinearForward<T>(x, w, b.row(), true, y_relu.view);
  LinearBackwardInput<T>(dy, w_transposed, gate, dx.view);
  LinearBackwardWeight<T>(x, dy, dw.view);
  for (int i = 0; i < B; ++i) {
    for (int o = 0; o < out; ++o) {
      double sum = b.view(0, o);
      for (int k = 0; k < in; ++k) sum += static_cast<double>(x.view(i, k)) * w.view(k, o);
      ASSERT_NEAR(y.view(i, o), sum, Tolerance<T>(in));
      ASSERT_EQ(y_relu.view(i, o), std::max(y.view(i, o), T{0}));
    }
    for (int k = 0; k < in; ++k) {
      double sum = 0;
      for (int o = 0; o < out; ++o) {
        sum += static_cast<double>(dy.view(i, o)) * w_transposed.view(o, k);
      }
      ASSERT_NEAR(dx.view(i, k), gate.view(i, k) > 0 ? sum : 0, Tolerance<T>(out));
    }
  }
  for (int k = 0; k < in; ++k) {
    for (int o = 0; o < out; ++o) {
      double sum = 0;
      for (int i = 0; i < B; ++i) sum += static_cast<double>(x.view(i, k)) * dy.view(i, o);
      ASSERT_NEAR(dw.view(k, o), sum, Tolerance<T>(B));
    }
  }
}

TEST_P(KernelTest, LinearLayersMatchTheirDefinitions) {
  // Sizes that are and are not multiples of tiles and registers, down to one.
  for (const auto& [B, in, out] : std::vector<std::tuple<int, int, int>>{
           {1, 1, 1}, {1, 8, 256}, {2, 3, 130}, {3, 5, 7}, {7, 64, 31}, {15, 8, 9}, {33, 65, 1}}) {
    CheckLinear<float>(B, in, out);
    CheckLinear<double>(B, in, out);
  }
}

TEST_P(KernelTest, ARowDoesNotDependOnTheRowsBesideIt) {
  // To the bit: or else the number of threads would show.
  const int B = 37, in = 70, out = 45;
  const Input<float> x(B, in, "x"), w(in, out, "w"), b(1, out, "b");
  Table<float> together(B, out, ""), alone(1, out, "");
  LinearForward<float>(x, w, b.row(), true, together.view);
  for (int i = 0; i < B; ++i) {
    LinearForward<float>(x.view.Rows(i, 1), w, b.row(), true, alone.view);
    ASSERT_TRUE(std::ranges::equal(alone.view.row(0), together.view.row(i))) << i;
  }
  Table<float> dw(in, out, ""), dw_rows(5, out, "");
  LinearBackwardWeight<float>(x, together, dw.view);
  LinearBackwardWeight<float>(x.view.Cols(11, 5), together, dw_rows.view);
  for (int k = 0; k < 5; ++k) {
    ASSERT_TRUE(std::ranges::equal(dw_rows.view.row(k), dw.view.row(11 + k)));
  }
}

TEST_P(KernelTest, TransposeTransposes) {
  for (const auto& [rows, cols] :
       std::vector<std::pair<int, int>>{{1, 1}, {4, 8}, {9, 256}, {37, 6}}) {
    const Input<float> x(rows, cols, "x");
    Table<float> y(cols, rows, "");
    Transpose<float>(x, y.view);
    for (int r = 0; r < rows; ++r) {
      for (int c = 0; c < cols; ++c) ASSERT_EQ(y.view(c, r), x.view(r, c));
    }
  }
}

TEST_P(KernelTest, SumsMatchTheirDefinitions) {
  for (const int n : {1, 7, 16, 37, 300}) {
    const Input<double> x(9, n, "x"), y(9, n, "y");
    Table<double> sum(1, n, ""), along(1, n, "");
    SumRows<double>(x, sum.row());
    LayerNormBackwardGain<double>(x, y, along.row());
    double squares = 0;
    for (int k = 0; k < n; ++k) {
      double column = 0, products = 0;
      for (int i = 0; i < 9; ++i) {
        column += x.view(i, k);
        products += x.view(i, k) * y.view(i, k);
      }
      ASSERT_NEAR(sum.view(0, k), column, 1e-13);
      ASSERT_NEAR(along.view(0, k), products, 1e-13);
      squares += x.view(0, k) * x.view(0, k);
    }
    ASSERT_NEAR(SquaredNorm<double>(x.row()), squares, 1e-13 * n);
  }
}

TEST_P(KernelTest, LayerNormRowsGetMeanZeroAndVarianceOneBeforeGainAndBias) {
  for (const int n : {1, 5, 37, 256}) {
    const int B = 3;
    const bool relu = n != 37;
    Table<double> x(B, n, "layer norm"), y(B, n, "");
    const Input<double> raw(B, n, "layer norm"), gain(1, n, "gain"), bias(1, n, "bias");
    Table<double> inv_std(1, B, "");
    LayerNormForward<double>(x.view, gain.row(), bias.row(), inv_std.row(), relu, y.view);
    for (int i = 0; i < B; ++i) {
      double mean = 0, square = 0;
      for (int k = 0; k < n; ++k) mean += raw.view(i, k) / n;
      for (int k = 0; k < n; ++k) square += std::pow(raw.view(i, k) - mean, 2) / n;
      for (int k = 0; k < n; ++k) {
        const double normal = (raw.view(i, k) - mean) / std::sqrt(square + 1e-5);
        ASSERT_NEAR(x.view(i, k), normal, 1e-12);
        const double expected = gain.view(0, k) * normal + bias.view(0, k);
        ASSERT_NEAR(y.view(i, k), relu ? std::max(0.0, expected) : expected, 1e-12);
      }
    }
  }
}

TEST_P(KernelTest, LayerNormGradientMatchesFiniteDifferences) {
  // f = Σ dy · (gain · x̂ + bias)
  const int n = 21;
  const double h = 1e-5;
  const Input<double> x(1, n, "x"), gain(1, n, "gain"), bias(1, n, "bias"), dy(1, n, "dy");
  AlignedVector<double> inv_std(1);
  const auto f = [&](int k, double step) {
    Table<double> moved(1, n, "x"), y(1, n, "");
    moved.view(0, k) += step;
    LayerNormForward<double>(moved.view, gain.row(), bias.row(), inv_std, false, y.view);
    double sum = 0;
    for (int i = 0; i < n; ++i) sum += dy.view(0, i) * y.view(0, i);
    return sum;
  };
  Table<double> x_hat(1, n, "x"), y(1, n, ""), dx(1, n, "");
  LayerNormForward<double>(x_hat.view, gain.row(), bias.row(), inv_std, false, y.view);
  LayerNormBackwardInput<double>(x_hat, gain.row(), inv_std, dy, dx.view);
  for (int k = 0; k < n; ++k) {
    EXPECT_NEAR(dx.view(0, k), (f(k, h) - f(k, -h)) / (2 * h), 1e-9);  // 1e-15 · 10 / h, and h²
  }
}

template <typename T>
void ExpectTanh(T tolerance) {
  const T infinity = std::numeric_limits<T>::infinity();
  // Alone and among others, near 0, where it bends, and where it is ±1.
  std::vector<T> x{T(1e-30),  T(-1e-5), T(0.3),  T(-0.5), T(1),    T(-4),  T(9),  T(-19), T(1e30),
                   -infinity, 0,        T(0.02), T(-0.9), T(0.55), T(7.5), T(-2), T(0.1)};
  for (size_t n = 1; n <= x.size(); ++n) {
    std::vector<T> y(x.begin(), x.begin() + static_cast<ptrdiff_t>(n)), dy(n, T{3});
    Tanh<T>(y);
    TanhBackward<T>(y, dy);
    for (size_t i = 0; i < n; ++i) {
      const T expected = std::tanh(x[i]);
      ASSERT_NEAR(y[i], expected, tolerance * std::abs(expected)) << x[i];
      ASSERT_NEAR(dy[i], 3 * (1 - y[i] * y[i]), 6 * tolerance) << x[i];
    }
  }
  std::vector<T> nan{std::numeric_limits<T>::quiet_NaN()};
  Tanh<T>(nan);
  EXPECT_TRUE(std::isnan(nan[0]));
}

TEST_P(KernelTest, TanhAndItsBackwardPass) {
  ExpectTanh<float>(4 * std::numeric_limits<float>::epsilon());
  ExpectTanh<double>(4 * std::numeric_limits<double>::epsilon());
}

template <typename T>
void ExpectSquashedSamples(T tolerance) {
  constexpr size_t kMost = 37;
  Rng rng(3, "samples");
  std::vector<T> mean, log_std, epsilon;
  for (size_t i = 0; i < kMost; ++i) {
    mean.push_back(static_cast<T>(i % 3 == 0 ? 20 * rng.Normal() : rng.Normal()));
    log_std.push_back(static_cast<T>(rng.Uniform(kLogStdLow, kLogStdHigh)));
    epsilon.push_back(static_cast<T>(rng.Normal()));
  }
  mean[5] = epsilon[5] = 0;
  for (size_t n = 1; n <= kMost; ++n) {
    std::vector<T> deviation(n), action(n), log_prob(n);
    const auto part = [&](const std::vector<T>& x) { return std::span<const T>(x).first(n); };
    SquashSamples<T>(part(mean), part(log_std), part(epsilon), deviation, action, log_prob);
    for (size_t i = 0; i < n; ++i) {
      const auto policy = Gaussian<T>::From(mean[i], log_std[i]);
      const Squashed<T> expected = Squash(policy, epsilon[i]);
      ASSERT_NEAR(deviation[i], policy.std, tolerance * policy.std);
      ASSERT_NEAR(action[i], expected.action, tolerance) << mean[i];
      // ln π has terms as large as 2 |u|.
      ASSERT_NEAR(log_prob[i], expected.log_prob,
                  tolerance * (4 + 4 * std::abs(mean[i]) + 4 * policy.std * std::abs(epsilon[i])));
    }
  }
}

TEST_P(KernelTest, SquashedSamplesAreThoseOfTheirDefinition) {
  ExpectSquashedSamples<float>(4 * std::numeric_limits<float>::epsilon());
  ExpectSquashedSamples<double>(4 * std::numeric_limits<double>::epsilon());
}

TEST_P(KernelTest, AdamAndPolyakInOnePass) {
  const AdamConstants<double> c{0.5, 0.9, 0.99, 0.01, 1e-3, 0.25};
  for (const int n : {1, 3, 50}) {
    const Input<double> g(1, n, "g"), m0(1, n, "m"), v0(1, n, "v"), p0(1, n, "p"), t0(1, n, "t");
    Table<double> m(1, n, "m"), v(1, n, "v"), p(1, n, "p"), t(1, n, "t");
    const auto square = [](double x) { return x * x; };
    for (double& x : v.row()) x = square(x);
    AdamPolyakStep<double>(c, g.row(), m.row(), v.row(), p.row(), t.row());
    for (int k = 0; k < n; ++k) {
      const double gradient = 0.5 * g.view(0, k);
      const double m_new = 0.9 * m0.view(0, k) + 0.1 * gradient;
      const double v_new = 0.99 * square(v0.view(0, k)) + 0.01 * square(gradient);
      const double p_new = p0.view(0, k) - 0.01 * m_new / (std::sqrt(v_new) + 1e-3);
      EXPECT_NEAR(m.view(0, k), m_new, 1e-14);
      EXPECT_NEAR(v.view(0, k), v_new, 1e-14);
      EXPECT_NEAR(p.view(0, k), p_new, 1e-14);
      EXPECT_NEAR(t.view(0, k), t0.view(0, k) + 0.25 * (p_new - t0.view(0, k)), 1e-14);
    }
  }
}

}  // namespace
}  // namespace upswing
