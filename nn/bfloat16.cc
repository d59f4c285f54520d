#include "nn/bfloat16.h"

#include <hwy/base.h>

#include <algorithm>

#include "core/aligned.h"
#include "core/error.h"
#include "core/text.h"
#include "nn/product.h"

#if HWY_ARCH_X86_64
#include <cpuid.h>
#include <immintrin.h>
#include <sys/syscall.h>
#include <unistd.h>

#include "nn/linear.h"
#endif

namespace upswing {
namespace {

using PairProduct = Product<uint32_t, float>;

}  // namespace

#if HWY_ARCH_X86_64

// ------------------------------------------------------------------------------------------------
// AVX512_BF16: tiles of C in registers, as in product.cc.

HWY_PUSH_ATTRIBUTES("avx512f,avx512bw,avx512vl,avx512dq,avx512bf16")
namespace {

constexpr int kLanes = 16;

__mmask16 FirstLanes(int count) {
  return static_cast<__mmask16>((1U << std::clamp(count, 0, kLanes)) - 1U);
}

/// 16 numbers in bfloat16, each in the low half of its lane.
__m512i Rounded(__m512 x) { return _mm512_cvtepu16_epi32((__m256i)_mm512_cvtneps_pbh(x)); }

/// The tile of C at (m, n) with kRows rows and up to kVectors · 16 columns.
template <int kRows, int kVectors>
HWY_INLINE void MultiplyTile(const PairProduct& p, int m, int n) {
  __mmask16 mask[kVectors];
  __m512 c[kRows][kVectors];
  HWY_UNROLL(2)
  for (int v = 0; v < kVectors; ++v) {
    mask[v] = FirstLanes(p.N - n - v * kLanes);
    const __m512 start = p.bias == nullptr
                             ? _mm512_setzero_ps()
                             : _mm512_maskz_loadu_ps(mask[v], p.bias + n + v * kLanes);
    HWY_UNROLL(8)
    for (int i = 0; i < kRows; ++i) c[i][v] = start;
  }

  const uint32_t* a = p.a + m * p.a_m;
  const uint32_t* b = p.b.data() + n;
  for (int k = 0; k < p.K; ++k) {
    __m512i b_row[kVectors];
    HWY_UNROLL(2)
    for (int v = 0; v < kVectors; ++v) {
      b_row[v] = _mm512_maskz_loadu_epi32(mask[v], b + v * kLanes);
    }
    HWY_UNROLL(8)
    for (int i = 0; i < kRows; ++i) {
      const __m512i a_ik = _mm512_set1_epi32(static_cast<int>(a[i * p.a_m]));
      HWY_UNROLL(2)
      for (int v = 0; v < kVectors; ++v) {
        c[i][v] = _mm512_dpbf16_ps(c[i][v], (__m512bh)a_ik, (__m512bh)b_row[v]);
      }
    }
    a += p.a_k;
    b += p.b.stride();
  }

  HWY_UNROLL(8)
  for (int i = 0; i < kRows; ++i) {
    HWY_UNROLL(2)
    for (int v = 0; v < kVectors; ++v) {
      const int col = n + v * kLanes;
      if (p.relu) c[i][v] = _mm512_max_ps(c[i][v], _mm512_setzero_ps());
      if (!p.gate.empty()) {
        const __m512 gate = _mm512_maskz_loadu_ps(mask[v], p.gate.row(m + i).data() + col);
        const __mmask16 open = _mm512_cmp_ps_mask(gate, _mm512_setzero_ps(), _CMP_GT_OQ);
        c[i][v] = _mm512_maskz_mov_ps(open, c[i][v]);
      }
      _mm512_mask_storeu_ps(p.c.row(m + i).data() + col, mask[v], c[i][v]);
    }
  }
}

/// All of C from row m on that can be cut into tiles of kRows rows; returns the first row after.
template <int kRows>
int MultiplyRows(const PairProduct& p, int m) {
  const int end = m + (p.M - m) / kRows * kRows;
  int n = 0;
  for (; n + kLanes < p.N; n += 2 * kLanes) {
    for (int i = m; i < end; i += kRows) MultiplyTile<kRows, 2>(p, i, n);
  }
  if (n < p.N) {
    for (int i = m; i < end; i += kRows) MultiplyTile<kRows, 1>(p, i, n);
  }
  return end;
}

void MultiplyAvx512(const PairProduct& p) {
  int m = MultiplyRows<8>(p, 0);
  m = MultiplyRows<4>(p, m);
  m = MultiplyRows<2>(p, m);
  MultiplyRows<1>(p, m);
}

/// y (n × ⌈m/2⌉) = x (n × m), rounded; pairs along the rows.
void RoundRows(Matrix<const float> x, Matrix<uint32_t> y) {
  for (int i = 0; i < x.rows(); ++i) {
    const float* from = x.row(i).data();
    auto* to = y.row(i).data();
    for (int k = 0; k < x.cols(); k += 2 * kLanes) {
      const int left = x.cols() - k;
      const __m512 low = _mm512_maskz_loadu_ps(FirstLanes(left), from + k);
      const __m512 high = _mm512_maskz_loadu_ps(FirstLanes(left - kLanes), from + k + kLanes);
      _mm512_mask_storeu_epi32(to + k / 2, FirstLanes(PairsIn(left)),
                               (__m512i)_mm512_cvtne2ps_pbh(high, low));
    }
  }
}

}  // namespace

void PackPairs(Matrix<const float> x, Matrix<uint32_t> pairs) {
  for (int i = 0; i < x.rows(); i += 2) {
    const float* first = x.row(i).data();
    const float* second = i + 1 < x.rows() ? x.row(i + 1).data() : nullptr;
    auto* to = pairs.row(i / 2).data();
    for (int k = 0; k < x.cols(); k += kLanes) {
      const __mmask16 mask = FirstLanes(x.cols() - k);
      __m512i pair = Rounded(_mm512_maskz_loadu_ps(mask, first + k));
      if (second != nullptr) {
        const __m512i high = Rounded(_mm512_maskz_loadu_ps(mask, second + k));
        pair = _mm512_or_si512(pair, _mm512_slli_epi32(high, 16));
      }
      _mm512_mask_storeu_epi32(to + k, mask, pair);
    }
  }
}
HWY_POP_ATTRIBUTES

// ------------------------------------------------------------------------------------------------
// AMX.

}  // namespace upswing
HWY_PUSH_ATTRIBUTES("avx512f,amx-tile,amx-bf16")
#include "nn/amx_tiles.h"  // here, so that its template is compiled for these instructions
namespace upswing {
namespace {

/// The tile registers themselves, by their instructions: g++'s intrinsics take no template
/// argument.
struct AmxTiles {
  template <int t>
  static HWY_INLINE void Zero() {
    asm volatile("tilezero %%tmm%c0" ::"i"(t));
  }
  template <int t>
  static HWY_INLINE void Load(const void* from, ptrdiff_t stride) {
    asm volatile("tileloadd (%0,%1,1), %%tmm%c2" ::"r"(from), "r"(stride), "i"(t) : "memory");
  }
  template <int c, int a, int b>
  static HWY_INLINE void Dot() {
    asm volatile("tdpbf16ps %%tmm%c2, %%tmm%c1, %%tmm%c0" ::"i"(c), "i"(a), "i"(b));
  }
  template <int t>
  static HWY_INLINE void Store(void* to, ptrdiff_t stride) {
    asm volatile("tilestored %%tmm%c2, (%0,%1,1)" ::"r"(to), "r"(stride), "i"(t) : "memory");
  }
};

/// What the instruction LDTILECFG reads (Intel, Software Developer's Manual, volume 1, 18.3).
struct alignas(64) TileConfig {
  uint8_t palette = 1;
  uint8_t start_row = 0;
  uint8_t reserved[14] = {};
  uint16_t row_bytes[16] = {};
  uint8_t rows[16] = {};
};

void MultiplyTiles(const PairProduct& p) {
  TileConfig config;
  std::fill_n(config.row_bytes, 8, static_cast<uint16_t>(kTile * sizeof(uint32_t)));
  std::fill_n(config.rows, 8, static_cast<uint8_t>(kTile));
  // g++ 12's intrinsic declares only the first 8 bytes as read.
  asm volatile("ldtilecfg %0" ::"m"(config));
  MultiplyByTiles<AmxTiles>(p);
  asm volatile("tilerelease");
}

}  // namespace
HWY_POP_ATTRIBUTES

namespace {

/// Adds the bias, applies ReLU and gate.
void Finish(const PairProduct& p) {
  for (int i = 0; i < p.M; ++i) {
    const auto row = p.c.row(i);
    for (size_t n = 0; n < row.size(); ++n) {
      if (p.bias != nullptr) row[n] += p.bias[n];
      if (p.relu) row[n] = std::max(row[n], 0.0F);
      if (!p.gate.empty() && !(p.gate.row(i)[n] > 0)) row[n] = 0;
    }
  }
}

/// A buffer for an operand in pairs, valid until the next call on this thread.
template <int kOperand>
Matrix<uint32_t> Scratch(int rows, int cols) {
  thread_local AlignedVector<uint32_t> values;
  values.resize(std::max(values.size(), static_cast<size_t>(rows) * static_cast<size_t>(cols)));
  return {values.data(), rows, cols};
}

/// Whole tiles by AMX, the margins by AVX512_BF16. Tiles read A by rows.
void MultiplyAmx(const PairProduct& p) {
  const int M = p.M / kTileBlock * kTileBlock;
  const int N = p.N / kTileBlock * kTileBlock;
  if (M == 0 || N == 0 || p.K % kTile != 0) return MultiplyAvx512(p);
  PairProduct whole = p.Part(0, M, 0, N);
  if (p.a_k != 1) {
    const Matrix<uint32_t> rows = Scratch<2>(M, p.K);
    // Pairs are copied as floats, which have the same size.
    Transpose<float>({reinterpret_cast<const float*>(p.a), p.K, M, static_cast<int>(p.a_k)},
                     {reinterpret_cast<float*>(rows.data()), M, p.K});
    whole.a = rows.data();
    whole.a_m = p.K;
    whole.a_k = 1;
  }
  MultiplyTiles(whole);
  Finish(whole);
  if (N < p.N) MultiplyAvx512(p.Part(0, M, N, p.N - N));
  if (M < p.M) MultiplyAvx512(p.Part(M, p.M - M, 0, p.N));
}

// ------------------------------------------------------------------------------------------------
// Choice of the path.

struct Path {
  const char* name;
  void (*multiply)(const PairProduct&);
};

/// Whether the processor has tiles, the system lets us use them, and they multiply as they should.
bool AmxWorks() {
  unsigned a = 0;
  unsigned b = 0;
  unsigned c = 0;
  unsigned d = 0;
  constexpr unsigned kTilesAndBfloat16 = 1U << 24U | 1U << 22U;
  if (__get_cpuid_count(7, 0, &a, &b, &c, &d) == 0) return false;
  if ((d & kTilesAndBfloat16) != kTilesAndBfloat16) return false;
  constexpr int kRequestPermission = 0x1023;  // ARCH_REQ_XCOMP_PERM
  constexpr int kTileData = 18;               // the state component XTILEDATA
  if (syscall(SYS_arch_prctl, kRequestPermission, kTileData) != 0) return false;

  constexpr int n = kTileBlock;
  constexpr int kPairs = 2 * kTile;
  AlignedVector<float> a_values(n * 2 * kPairs), b_values(a_values.size()), by_tiles(n * n);
  for (size_t i = 0; i < a_values.size(); ++i) {
    a_values[i] = static_cast<float>(i % 7) - 3;
    b_values[i] = static_cast<float>(i % 5) - 2;
  }
  AlignedVector<uint32_t> a_pairs(n * kPairs), b_pairs(a_pairs.size());
  PackPairs({a_values.data(), 2 * kPairs, n}, {a_pairs.data(), kPairs, n});
  PackPairs({b_values.data(), 2 * kPairs, n}, {b_pairs.data(), kPairs, n});
  AlignedVector<float> by_avx512(by_tiles.size());
  PairProduct product{.M = n,
                      .N = n,
                      .K = kPairs,
                      .a = a_pairs.data(),
                      .a_m = 1,
                      .a_k = n,
                      .b = {b_pairs.data(), kPairs, n},
                      .c = {}};
  product.c = {by_tiles.data(), n, n};
  MultiplyAmx(product);
  product.c = {by_avx512.data(), n, n};
  MultiplyAvx512(product);
  return by_tiles == by_avx512;  // small integers: both are exact
}

const std::vector<Path>& Paths() {
  static const std::vector<Path> kUsable = [] {
    std::vector<Path> found;
    __builtin_cpu_init();
    if (__builtin_cpu_supports("avx512bf16") && __builtin_cpu_supports("avx512bw") &&
        __builtin_cpu_supports("avx512vl") && __builtin_cpu_supports("avx512dq")) {
      if (AmxWorks()) found.push_back({"amx", &MultiplyAmx});
      found.push_back({"avx512_bf16", &MultiplyAvx512});
    }
    return found;
  }();
  return kUsable;
}

/// The path in use; only called where there is one.
const Path*& Used() {
  static const Path* used = &Paths().front();
  return used;
}

}  // namespace

std::vector<std::string> Bfloat16Paths() {
  std::vector<std::string> names;
  for (const Path& path : Paths()) names.emplace_back(path.name);
  return names;
}

void UseBfloat16Path(std::string_view path) {
  const auto found =
      std::ranges::find(Paths(), path, [](const Path& p) -> std::string_view { return p.name; });
  if (found == Paths().end()) {
    throw BadInput(Concat("bfloat16 instructions: expected one of [", Join(Bfloat16Paths(), ", "),
                          "] on this processor, got '", path, "'"));
  }
  Used() = &*found;
}

void LinearForwardBfloat16(Matrix<const float> x, Matrix<const uint32_t> w_pairs,
                           std::span<const float> b, bool relu, Matrix<float> y) {
  const Matrix<uint32_t> a = Scratch<0>(x.rows(), w_pairs.rows());
  RoundRows(x, a);
  Used()->multiply({.M = y.rows(),
                    .N = y.cols(),
                    .K = a.cols(),
                    .a = a.data(),
                    .a_m = a.stride(),
                    .a_k = 1,
                    .b = w_pairs,
                    .c = y,
                    .bias = b.data(),
                    .relu = relu});
}

void LinearBackwardInputBfloat16(Matrix<const float> dy, Matrix<const uint32_t> w_transposed_pairs,
                                 Matrix<const float> gate, Matrix<float> dx) {
  const Matrix<uint32_t> a = Scratch<0>(dy.rows(), w_transposed_pairs.rows());
  RoundRows(dy, a);
  Used()->multiply({.M = dx.rows(),
                    .N = dx.cols(),
                    .K = a.cols(),
                    .a = a.data(),
                    .a_m = a.stride(),
                    .a_k = 1,
                    .b = w_transposed_pairs,
                    .c = dx,
                    .gate = gate});
}

void LinearBackwardWeightBfloat16(Matrix<const float> x, Matrix<const float> dy, Matrix<float> dw) {
  const Matrix<uint32_t> a = Scratch<0>(PairsIn(x.rows()), x.cols());
  const Matrix<uint32_t> b = Scratch<1>(PairsIn(dy.rows()), dy.cols());
  PackPairs(x, a);
  PackPairs(dy, b);
  Used()->multiply({.M = dw.rows(),
                    .N = dw.cols(),
                    .K = a.rows(),
                    .a = a.data(),
                    .a_m = 1,
                    .a_k = a.stride(),
                    .b = b,
                    .c = dw});
}

#else  // an architecture for which we know no bfloat16 instructions

std::vector<std::string> Bfloat16Paths() { return {}; }

void UseBfloat16Path(std::string_view path) {
  throw BadInput(Concat("bfloat16 instructions: this processor has none, got '", path, "'"));
}

void PackPairs(Matrix<const float>, Matrix<uint32_t>) {
  throw Failure("this processor has no bfloat16 instructions");
}
void LinearForwardBfloat16(Matrix<const float> x, Matrix<const uint32_t>, std::span<const float>,
                           bool, Matrix<float>) {
  PackPairs(x, {});
}
void LinearBackwardInputBfloat16(Matrix<const float> dy, Matrix<const uint32_t>,
                                 Matrix<const float>, Matrix<float>) {
  PackPairs(dy, {});
}
void LinearBackwardWeightBfloat16(Matrix<const float> x, Matrix<const float>, Matrix<float>) {
  PackPairs(x, {});
}

#endif

}  // namespace upswing
