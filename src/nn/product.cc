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
#if HWY_TARGET == HWY_AVX3 || HWY_ARCH_ARM_A64  // of 32 registers
constexpr int kTileRows = 8;
constexpr int kRegisters = 16;
#else  // of 16
constexpr int kTileRows = 6;
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

/// Computes the tile of C at (m, n). If kPartial, the last register of a row has `count` numbers.
template <int kRows, int kVectors, bool kPartial>
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
  Real* to = &p.c(m, n);
  const ptrdiff_t stride = p.c.stride();
  ForTile<kRows, kVectors>([&](int i, int v) HWY_ATTR {
    if (kPartial && v == kVectors - 1) {
      Store<kPartial>(c[i][v], to + i * stride + v * lanes, count);
    } else {
      hn::StoreU(c[i][v], d, to + i * stride + v * lanes);
    }
  });
}

/// Computes rows m to `end` of C from column n: tiles of kRows × `vectors` registers
/// (`vectors` ≤ kVectors), then a narrower tile for the remaining columns.
template <int kRows, int kVectors>
void MultiplyColumns(const Product& p, int m, int end, int n, int vectors) {
  if constexpr (kVectors > 1) {
    if (vectors < kVectors) return MultiplyColumns<kRows, kVectors - 1>(p, m, end, n, vectors);
  }
  const int lanes = static_cast<int>(hn::Lanes(Tag()));
  for (; n + kVectors * lanes <= p.N; n += kVectors * lanes) {
    for (int i = m; i < end; i += kRows) MultiplyTile<kRows, kVectors, false>(p, i, n, 0);
  }
  const int rest = (p.N - n + lanes - 1) / lanes;
  if constexpr (kVectors > 1) {
    if (rest > 0 && rest < kVectors) {
      return MultiplyColumns<kRows, kVectors - 1>(p, m, end, n, rest);
    }
  }
  if (rest == 0) return;
  const size_t count = static_cast<size_t>(p.N - n - 1) % hn::Lanes(Tag()) + 1;
  for (int i = m; i < end; i += kRows) MultiplyTile<kRows, kVectors, true>(p, i, n, count);
}

/// Computes the rows of C from row m that fill tiles of kRows rows. Returns the first row after
/// them.
template <int kRows>
int MultiplyRows(const Product& p, int m) {
  // Use as few tiles as the registers allow, of about equal width: narrow tiles have too few sums
  // in flight.
  constexpr int kVectors = std::min(kRegisters / kRows, kWidestTile);
  const int lanes = static_cast<int>(hn::Lanes(Tag()));
  const int vectors = (p.N + lanes - 1) / lanes;
  const int tiles = (vectors + kVectors - 1) / kVectors;
  const int end = m + (p.M - m) / kRows * kRows;
  if (end > m) MultiplyColumns<kRows, kVectors>(p, m, end, 0, (vectors + tiles - 1) / tiles);
  return end;
}

// ------------------------------------------------------------------------------------------------
// Kernel for few columns, which do not fill a register. Each register holds one column of as many
// rows as it has lanes. Loading transposes A where its rows lie along K, and broadcasts the numbers
// of B. Every sum runs over K in the same order as in a tile.

#if HWY_TARGET != HWY_SCALAR
constexpr int kMostNarrow = 4;  // columns of C

/// Loads four numbers from every fourth row, beginning at `from`. In the register the rows follow
/// each other.
template <class D>
HWY_INLINE hn::Vec<D> LoadFourthRows(D d, const Real* from, ptrdiff_t row) {
  if constexpr (hn::MaxLanes(D()) <= 4) {
    return hn::LoadU(d, from);
  } else {
    const hn::Half<D> half;
    const auto blocks = static_cast<ptrdiff_t>(hn::Lanes(half) / 4);
    return hn::Combine(d, LoadFourthRows(half, from + 4 * blocks * row, row),
                       LoadFourthRows(half, from, row));
  }
}

/// Loads A(m, k) for four consecutive k, with one row per lane, beginning at `a`. kAlongK: a_k = 1,
/// otherwise a_m = 1.
template <bool kAlongK>
HWY_INLINE void LoadRows(const Product& p, const Real* a, Vec (&rows)[4]) {
  const Tag d;
  HWY_UNROLL(4)
  for (int i = 0; i < 4; ++i) {
    rows[i] = kAlongK ? LoadFourthRows(d, a + i * p.a_m, p.a_m) : hn::LoadU(d, a + i * p.a_k);
  }
  if constexpr (kAlongK) TransposeBlocks(d, rows);
}

/// Computes kBlocks registers of rows from row m, for all kColumns columns. K is a multiple of
/// four.
template <int kBlocks, int kColumns, bool kAlongK>
HWY_INLINE void MultiplyNarrowBlocks(const Product& p, int m) {
  const Tag d;
  const int lanes = static_cast<int>(hn::Lanes(d));
  Vec c[kBlocks][kColumns];
  HWY_UNROLL(4)
  for (int n = 0; n < kColumns; ++n) {
    const Vec start = p.bias == nullptr ? hn::Zero(d) : hn::Set(d, p.bias[n]);
    HWY_UNROLL(2)
    for (int block = 0; block < kBlocks; ++block) c[block][n] = start;
  }

  const Real* a = p.a + m * p.a_m;
  for (int k = 0; k < p.K; k += 4) {
    HWY_UNROLL(2)
    for (int block = 0; block < kBlocks; ++block) {
      Vec rows[4];
      LoadRows<kAlongK>(p, a + block * lanes * p.a_m, rows);
      HWY_UNROLL(4)
      for (int i = 0; i < 4; ++i) {
        HWY_UNROLL(4)
        for (int n = 0; n < kColumns; ++n) {
          c[block][n] = hn::MulAdd(rows[i], hn::Set(d, p.b(k + i, n)), c[block][n]);
        }
      }
    }
    a += 4 * p.a_k;
  }

  HWY_ALIGN Real column[HWY_LANES(Real)];
  for (int block = 0; block < kBlocks; ++block) {
    for (int n = 0; n < kColumns; ++n) {
      if (p.relu) c[block][n] = hn::Max(c[block][n], hn::Zero(d));
      hn::Store(c[block][n], d, column);
      for (int i = 0; i < lanes; ++i) {
        const int row = m + block * lanes + i;
        p.c(row, n) = p.gate.empty() || p.gate(row, n) > 0 ? column[i] : 0;
      }
    }
  }
}

/// Computes the rows that fill whole registers. Returns the first row after them.
template <int kColumns, bool kAlongK>
int MultiplyNarrowRows(const Product& p) {
  const int lanes = static_cast<int>(hn::Lanes(Tag()));
  int m = 0;
  for (; m + 2 * lanes <= p.M; m += 2 * lanes) MultiplyNarrowBlocks<2, kColumns, kAlongK>(p, m);
  for (; m + lanes <= p.M; m += lanes) MultiplyNarrowBlocks<1, kColumns, kAlongK>(p, m);
  return m;
}

template <int kColumns>
int MultiplyNarrow(const Product& p) {
  if constexpr (kColumns > kMostNarrow) {
    return 0;
  } else {
    if (p.N != kColumns) return MultiplyNarrow<kColumns + 1>(p);
    if (p.a_k == 1) return MultiplyNarrowRows<kColumns, true>(p);
    if (p.a_m == 1) return MultiplyNarrowRows<kColumns, false>(p);
    return 0;
  }
}
#endif

void Multiply(const Product& p) {
  int m = 0;
#if HWY_TARGET != HWY_SCALAR
  if (sizeof(Real) == 4 && p.K % 4 == 0) m = MultiplyNarrow<1>(p);
#endif
  m = MultiplyRows<kTileRows>(p, m);
  m = MultiplyRows<4>(p, m);
  m = MultiplyRows<2>(p, m);
  MultiplyRows<1>(p, m);
}

}  // namespace upswing::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace upswing {

HWY_EXPORT(Multiply);

void Multiply(const Product& product) { HWY_DYNAMIC_DISPATCH(Multiply)(product); }

}  // namespace upswing
#endif  // HWY_ONCE
