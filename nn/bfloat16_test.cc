#include "nn/bfloat16.h"

#include <gtest/gtest.h>

#include <bit>
#include <cstring>
#include <tuple>

#include "core/aligned.h"
#include "core/error.h"
#include "core/rng.h"
#include "nn/amx_tiles.h"

namespace upswing {
namespace {

AlignedVector<float> RandomNumbers(int n, const char* stream) {
  Rng rng(7, stream);
  AlignedVector<float> values(static_cast<size_t>(n));
  for (float& x : values) x = static_cast<float>(rng.Normal());
  return values;
}

/// The nearest bfloat16, of two equally near the even one (IEEE 754), as a float.
float Rounded(float x) {
  const auto bits = std::bit_cast<uint32_t>(x);
  const uint32_t up = 0x7fffU + ((bits >> 16U) & 1U);
  return std::bit_cast<float>((bits + up) & 0xffff0000U);
}

/// Each kind of instructions that this machine has, against the definition in double.
class Bfloat16Test : public ::testing::TestWithParam<std::string> {
 protected:
  void SetUp() override { UseBfloat16Path(GetParam()); }
  void TearDown() override { UseBfloat16Path(Bfloat16Paths().front()); }
};
INSTANTIATE_TEST_SUITE_P(Paths, Bfloat16Test, ::testing::ValuesIn(Bfloat16Paths()),
                         [](const auto& info) { return info.param; });
GTEST_ALLOW_UNINSTANTIATED_PARAMETERIZED_TEST(Bfloat16Test);

TEST_P(Bfloat16Test, ProductsAreThoseOfRoundedNumbers) {
  for (const auto& [B, in, out] : std::vector<std::tuple<int, int, int>>{
           {1, 1, 1}, {3, 5, 7}, {32, 8, 64}, {35, 33, 9}, {64, 96, 70}, {128, 64, 40}}) {
    SCOPED_TRACE(::testing::Message() << B << " × " << in << " × " << out);
    auto x = RandomNumbers(B * in, "x"), w = RandomNumbers(in * out, "w");
    auto b = RandomNumbers(out, "b"), dy = RandomNumbers(B * out, "dy");
    auto w_transposed = RandomNumbers(in * out, "wt"), gate = RandomNumbers(B * in, "gate");
    AlignedVector<float> y(dy.size()), dx(x.size()), dw(w.size());
    const Matrix<float> X(x, B, in), W(w, in, out), DY(dy, B, out), WT(w_transposed, out, in),
        G(gate, B, in), Y(y, B, out), DX(dx, B, in), DW(dw, in, out);
    AlignedVector<uint32_t> pairs(w.size() + static_cast<size_t>(in + out));
    const Matrix<uint32_t> w_pairs(pairs.data(), (in + 1) / 2, out);
    PackPairs(W, w_pairs);
    LinearForwardBfloat16(X, w_pairs, b, true, Y);
    const Matrix<uint32_t> wt_pairs(pairs.data(), (out + 1) / 2, in);
    PackPairs(WT, wt_pairs);
    LinearBackwardInputBfloat16(DY, wt_pairs, G, DX);
    LinearBackwardWeightBfloat16(X, DY, DW);

    // Products of two bfloat16 are exact in float; the sums round as float.
    const auto tolerance = [](int n) { return 1e-6 * (n + 8); };
    const auto product = [](float p, float q) {
      return static_cast<double>(Rounded(p)) * Rounded(q);
    };
    for (int i = 0; i < B; ++i) {
      for (int o = 0; o < out; ++o) {
        double sum = b[static_cast<size_t>(o)];
        for (int k = 0; k < in; ++k) sum += product(X(i, k), W(k, o));
        ASSERT_NEAR(Y(i, o), std::max(sum, 0.0), tolerance(in));
      }
      for (int k = 0; k < in; ++k) {
        double sum = 0;
        for (int o = 0; o < out; ++o) sum += product(DY(i, o), WT(o, k));
        ASSERT_NEAR(DX(i, k), G(i, k) > 0 ? sum : 0, tolerance(out));
      }
    }
    for (int k = 0; k < in; ++k) {
      for (int o = 0; o < out; ++o) {
        double sum = 0;
        for (int i = 0; i < B; ++i) sum += product(X(i, k), DY(i, o));
        ASSERT_NEAR(DW(k, o), sum, tolerance(B));
      }
    }
  }
}

TEST(Bfloat16, AnotherPathIsRefused) { EXPECT_THROW(UseBfloat16Path("abacus"), Error); }

/// What the tile instructions do, in plain code (Intel, Software Developer's Manual, TDPBF16PS).
struct PlainTiles {
  static inline uint32_t tile[8][kTile][kTile];

  template <int t>
  static void Zero() {
    std::memset(tile[t], 0, sizeof(tile[t]));
  }
  template <int t>
  static void Load(const void* from, ptrdiff_t stride) {
    for (int i = 0; i < kTile; ++i) {
      std::memcpy(tile[t][i], static_cast<const char*>(from) + i * stride, sizeof(tile[t][i]));
    }
  }
  template <int c, int a, int b>
  static void Dot() {
    const auto low = [](uint32_t pair) { return std::bit_cast<float>(pair << 16U); };
    const auto high = [](uint32_t pair) { return std::bit_cast<float>(pair & 0xffff0000U); };
    for (int m = 0; m < kTile; ++m) {
      for (int k = 0; k < kTile; ++k) {
        for (int n = 0; n < kTile; ++n) {
          auto sum = std::bit_cast<float>(tile[c][m][n]);
          sum += low(tile[a][m][k]) * low(tile[b][k][n]);
          sum += high(tile[a][m][k]) * high(tile[b][k][n]);
          tile[c][m][n] = std::bit_cast<uint32_t>(sum);
        }
      }
    }
  }
  template <int t>
  static void Store(void* to, ptrdiff_t stride) {
    for (int i = 0; i < kTile; ++i) {
      std::memcpy(static_cast<char*>(to) + i * stride, tile[t][i], sizeof(tile[t][i]));
    }
  }
};

TEST(AmxTiles, TheOrderOfTilesMakesAProduct) {
  // Whole numbers, which bfloat16 and float hold exactly; matrices wider than the product.
  constexpr int M = 64, N = 96, K = 48, kGap = 5;
  Rng rng(3, "tiles");
  const auto pair = [&](int& low, int& high) {
    low = static_cast<int>(rng.Below(9)) - 4;
    high = static_cast<int>(rng.Below(9)) - 4;
    return std::bit_cast<uint32_t>(static_cast<float>(low)) >> 16U |
           std::bit_cast<uint32_t>(static_cast<float>(high));
  };
  std::vector<uint32_t> a(M * (K + kGap)), b(K * (N + kGap));
  std::vector<float> c(M * (N + kGap), -1.0F);
  std::vector<int> a_number(M * 2 * K), b_number(2 * K * N);
  for (int m = 0; m < M; ++m) {
    for (int k = 0; k < K; ++k) {
      auto* number = &a_number[static_cast<size_t>(m * 2 * K + 2 * k)];
      a[static_cast<size_t>(m * (K + kGap) + k)] = pair(number[0], number[1]);
    }
  }
  for (int k = 0; k < K; ++k) {
    for (int n = 0; n < N; ++n) {
      b[static_cast<size_t>(k * (N + kGap) + n)] =
          pair(b_number[static_cast<size_t>(2 * k * N + n)],
               b_number[static_cast<size_t>((2 * k + 1) * N + n)]);
    }
  }
  MultiplyByTiles<PlainTiles>({.M = M,
                               .N = N,
                               .K = K,
                               .a = a.data(),
                               .a_m = K + kGap,
                               .a_k = 1,
                               .b = {b.data(), K, N, N + kGap},
                               .c = {c.data(), M, N, N + kGap}});
  for (int m = 0; m < M; ++m) {
    for (int n = 0; n < N; ++n) {
      int sum = 0;
      for (int k = 0; k < 2 * K; ++k) {
        sum +=
            a_number[static_cast<size_t>(m * 2 * K + k)] * b_number[static_cast<size_t>(k * N + n)];
      }
      ASSERT_EQ(c[static_cast<size_t>(m * (N + kGap) + n)], static_cast<float>(sum));
    }
    for (int n = N; n < N + kGap; ++n) EXPECT_EQ(c[static_cast<size_t>(m * (N + kGap) + n)], -1.0F);
  }
}

}  // namespace
}  // namespace upswing
