// The matrix products of the kernels, written once with Highway and compiled for each instruction
// set. One kernel, C = A · B, computes the three products of a linear layer. It reads A along rows
// or along columns.
#include "nn/product.h"

#include <algorithm>

#include "base/simd.h"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "nn/product.cc"
#include <hwy/foreach_target.h>  // includes this file once per target
// must come after foreach_target.h
#include <hwy/highway.h>

#include "nn/registers-inl.h"

HWY_BEFORE_NAMESPACE();
namespace upswing::HWY_NAMESPACE {

// A tile of C, kRows × kVectors registers, stays in registers over all of K. Weights of these sizes
// stay in the L2 cache, so packing them would gain nothing.

/// Tile shapes: kRegisters registers hold C, and others hold a row of B and a number of A. Tiles
/// for single rows and for the rest of M have fewer rows and are wider. A multiply-add takes
/// several cycles, so as many of them must be in flight.
#if HWY_TARGET == HWY_AVX3  // of 32 registers
constexpr int kTileRows = 6;
constexpr int kTallRows = 8;
constexpr int kRegisters = 24;
#elif HWY_ARCH_ARM_A64  // of 32
constexpr int kTileRows = 8;
constexpr int kTallRows = 8;
constexpr int kRegisters = 16;
#else                   // of 16
constexpr int kTileRows = 6;
constexpr int kTallRows = 6;
constexpr int kRegisters = 12;
#endif
constexpr int kWidestTile = 8;  // registers per row

/// Calls `f(row, register)` for each register of a tile.
template <int kRows, int kVectors, typename F>
HWY_INLINE void ForTile(const F& f) {
  HWY_UNROLL(16)
  for (int i = 0; i < kRows; ++i) {
    HWY_UNROLL(16)
    for (int v = 0; v < kVectors; ++v) f(i, v);
  }
}

/// Computes the tile of C at (m, n), and the sums of the rows of B if kSum. If kPartial, the last
/// register of a row has `count` numbers.
template <int kRows, int kVectors, bool kPartial, bool kSum>
HWY_INLINE void MultiplyTile(const Product& p, int m, int n, size_t count) {
  const Tag d;
  const int lanes = static_cast<int>(hn::Lanes(d));
  // Loads register v of a row of numbers.
  const auto load = [&](const Real* row, int v) HWY_ATTR {
    return kPartial && v == kVectors - 1 ? Load<kPartial>(row + v * lanes, count)
                                         : hn::LoadU(d, row + v * lanes);
  };
  Vec c[kRows][kVectors];
  HWY_UNROLL(16)
  for (int v = 0; v < kVectors; ++v) {
    const Vec start = p.bias == nullptr ? hn::Zero(d) : load(p.bias + n, v);
    HWY_UNROLL(16)
    for (int i = 0; i < kRows; ++i) c[i][v] = start;
  }
  [[maybe_unused]] Vec sum[kVectors];
  if constexpr (kSum) std::fill_n(sum, kVectors, hn::Zero(d));

  const Real* a = p.a + m * p.a_m;
  const Real* b = p.b.data() + n;
  for (int k = 0; k < p.K; ++k) {
    Vec b_row[kVectors];
    HWY_UNROLL(16)
    for (int v = 0; v < kVectors; ++v) b_row[v] = load(b, v);
    HWY_UNROLL(16)
    for (int i = 0; i < kRows; ++i) {
      const Vec a_ik = hn::Set(d, a[i * p.a_m]);
      HWY_UNROLL(16)
      for (int v = 0; v < kVectors; ++v) c[i][v] = hn::MulAdd(a_ik, b_row[v], c[i][v]);
    }
    if constexpr (kSum) {
      HWY_UNROLL(16)
      for (int v = 0; v < kVectors; ++v) sum[v] = hn::Add(sum[v], b_row[v]);
    }
    a += p.a_k;
    b += p.b.stride();
  }

  // Test once per tile, not once per register.
  if (p.relu) {
    ForTile<kRows, kVectors>([&](int i, int v)
                                 HWY_ATTR { c[i][v] = hn::Max(c[i][v], hn::Zero(d)); });
  }
  if (!p.gate.empty()) {
    const Real* gate = &p.gate(m, n);
    const ptrdiff_t stride = p.gate.stride();
    ForTile<kRows, kVectors>([&](int i, int v) HWY_ATTR {
      const Vec open = load(gate + i * stride, v);
      c[i][v] = hn::IfThenElseZero(hn::Gt(open, hn::Zero(d)), c[i][v]);
    });
  }
  const auto store = [&](Vec value, Real* row, int v) HWY_ATTR {
    if (kPartial && v == kVectors - 1) {
      Store<kPartial>(value, row + v * lanes, count);
    } else {
      hn::StoreU(value, d, row + v * lanes);
    }
  };
  Real* to = &p.c(m, n);
  const ptrdiff_t stride = p.c.stride();
  ForTile<kRows, kVectors>([&](int i, int v) HWY_ATTR { store(c[i][v], to + i * stride, v); });
  if constexpr (kSum) {
    for (int v = 0; v < kVectors; ++v) store(sum[v], p.b_sum.data() + n, v);
  }
}

/// Computes rows m to `end` of C from column n: tiles of kRows × `vectors` registers
/// (`vectors` ≤ kVectors), then a narrower tile for the remaining columns.
template <int kRows, int kVectors, bool kSum>
void MultiplyColumns(const Product& p, int m, int end, int n, int vectors) {
  if constexpr (kVectors > 1) {
    if (vectors < kVectors)
      return MultiplyColumns<kRows, kVectors - 1, kSum>(p, m, end, n, vectors);
  }
  const int lanes = static_cast<int>(hn::Lanes(Tag()));
  for (; n + kVectors * lanes <= p.N; n += kVectors * lanes) {
    for (int i = m; i < end; i += kRows) MultiplyTile<kRows, kVectors, false, kSum>(p, i, n, 0);
  }
  const int rest = (p.N - n + lanes - 1) / lanes;
  if constexpr (kVectors > 1) {
    if (rest > 0 && rest < kVectors) {
      return MultiplyColumns<kRows, kVectors - 1, kSum>(p, m, end, n, rest);
    }
  }
  if (rest == 0) return;
  const size_t count = static_cast<size_t>(p.N - n - 1) % hn::Lanes(Tag()) + 1;
  for (int i = m; i < end; i += kRows) MultiplyTile<kRows, kVectors, true, kSum>(p, i, n, count);
}

/// Computes the rows m to `end` of C that fill tiles of kRows rows, and the sums of the rows of B
/// if kSum. Returns the first row after them.
template <int kRows, bool kSum = false>
int MultiplyRows(const Product& p, int m, int end) {
  end = m + (end - m) / kRows * kRows;
  if (end == m) return m;
  // Use as few tiles as the registers allow, of about equal width: narrow tiles have too few sums
  // in flight.
  constexpr int kVectors = std::min(kRegisters / (kSum ? kRows + 1 : kRows), kWidestTile);
  const int lanes = static_cast<int>(hn::Lanes(Tag()));
  const int vectors = (p.N + lanes - 1) / lanes;
  const int tiles = (vectors + kVectors - 1) / kVectors;
  MultiplyColumns<kRows, kVectors, kSum>(p, m, end, 0, (vectors + tiles - 1) / tiles);
  return end;
}

// With few columns, such as the outputs of a critic, most of a row's register would be empty.
// There, a register holds the same column of many rows. The sums are the same.

#if HWY_TARGET != HWY_SCALAR
/// Computes kGroups · kLanes rows of C from row m. C has kCols columns.
template <int kCols, int kGroups>
HWY_INLINE void MultiplyFewColumns(const Product& p, int m) {
  constexpr int kRows = kLanes;
  const Tag d;
  Vec c[kGroups][kCols];
  ForTile<kGroups, kCols>([&](int g, int n) HWY_ATTR {
    c[g][n] = p.bias == nullptr ? hn::Zero(d) : hn::Set(d, p.bias[n]);
  });
  for (int k = 0; k < p.K; k += 4) {
    HWY_UNROLL(2)
    for (int g = 0; g < kGroups; ++g) {
      Vec a[4];  // columns k to k + 3
      LoadColumns(d, p.a + (m + g * kRows) * p.a_m + k, p.a_m, a);
      ForTile<4, kCols>([&](int i, int n) HWY_ATTR {
        c[g][n] = hn::MulAdd(a[i], hn::Set(d, p.b(k + i, n)), c[g][n]);
      });
    }
  }
  for (int g = 0; g < kGroups; ++g, m += kRows) {
    if (kCols == 1 && p.c.stride() == 1) {
      hn::StoreU(c[g][0], d, &p.c(m, 0));
      continue;
    }
    HWY_ALIGN Real columns[kCols][kLanes];
    for (int n = 0; n < kCols; ++n) hn::Store(c[g][n], d, columns[n]);
    for (int r = 0; r < kRows; ++r) {
      for (int n = 0; n < kCols; ++n) p.c(m + r, n) = columns[n][r];
    }
  }
}

/// Computes C, and returns true, if C has at most kCols columns and the product fits
/// MultiplyFewColumns.
template <int kCols>
bool TryFewColumns(const Product& p) {
  if constexpr (sizeof(Real) == 4 && kCols > 0) {
    if (p.N != kCols) return TryFewColumns<kCols - 1>(p);
    constexpr int kRows = kLanes;
    if (p.M < kRows || p.K % 4 != 0 || p.a_k != 1) return false;
    if (p.relu || !p.gate.empty() || !p.b_sum.empty()) return false;
    int m = 0;
    for (; m + 2 * kRows <= p.M; m += 2 * kRows) MultiplyFewColumns<kCols, 2>(p, m);
    // The last call may compute some rows again.
    for (; m < p.M; m += kRows) MultiplyFewColumns<kCols, 1>(p, std::min(m, p.M - kRows));
    return true;
  }
  return false;
}
#endif

/// Computes the first rows of C and the sums of the rows of B. Returns the number of these rows.
int MultiplyFirstRows(const Product& p) {
  int m = MultiplyRows<4, true>(p, 0, std::min(p.M, 4));
  if (m == 0) m = MultiplyRows<3, true>(p, 0, p.M);
  if (m == 0) m = MultiplyRows<1, true>(p, 0, 1);
  return m;
}

void Multiply(const Product& p) {
#if HWY_TARGET != HWY_SCALAR
  if (TryFewColumns<4>(p)) return;
#endif
  int m = p.b_sum.empty() ? 0 : MultiplyFirstRows(p);
  // Tall tiles are for a C of one register per row. One tall tile also covers a remainder of two
  // rows.
  const bool narrow = p.N <= static_cast<int>(kLanes);
  const bool leaves_two_rows = (p.M - m) % kTileRows == kTallRows - kTileRows;
  int tall_end = m;
  if (narrow) {
    tall_end = p.M;
  } else if (leaves_two_rows) {
    tall_end = std::min(m + kTallRows, p.M);
  }
  m = MultiplyRows<kTallRows>(p, m, tall_end);
  m = MultiplyRows<kTileRows>(p, m, p.M);
  m = MultiplyRows<4>(p, m, p.M);
  m = MultiplyRows<2>(p, m, p.M);
  MultiplyRows<1>(p, m, p.M);
}

}  // namespace upswing::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace upswing {

HWY_EXPORT(Multiply);

void Multiply(const Product& product) { HWY_DYNAMIC_DISPATCH(Multiply)(product); }

}  // namespace upswing
#endif  // HWY_ONCE
