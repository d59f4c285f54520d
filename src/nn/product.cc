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

void Multiply(const Product& p) {
  int m = MultiplyRows<kTileRows>(p, 0);
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
