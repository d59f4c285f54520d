#pragma once

#include <cstdint>

#include "core/matrix.h"
#include "nn/product.h"

namespace upswing {

/// Rows of a tile, and 32-bit numbers in each.
inline constexpr int kTile = 16;
/// Rows and columns of C that are computed together: 2 × 2 tiles.
inline constexpr int kTileBlock = 2 * kTile;

/// C = A · B without bias, ReLU and gate, for M and N that are multiples of kTileBlock, K (pairs) a
/// multiple of kTile, and a_k = 1. Tiles is the processor's tile registers 0 … 7, or a stand-in:
///   Tiles::Zero<t>()              t = 0
///   Tiles::Load<t>(from, stride)  t = kTile rows of kTile 32-bit numbers, `stride` bytes apart
///   Tiles::Dot<c, a, b>()         c(m, n) += Σ_k a(m, k).low · b(k, n).low + a.high · b.high
///   Tiles::Store<t>(to, stride)
/// (Intel, Intrinsics Guide: _tile_zero, _tile_loadd, _tile_dpbf16ps, _tile_stored.)
template <typename Tiles>
void MultiplyByTiles(const Product<uint32_t, float>& p) {
  const auto a_stride = static_cast<ptrdiff_t>(p.a_m * sizeof(uint32_t));
  const auto b_stride = static_cast<ptrdiff_t>(p.b.stride() * sizeof(uint32_t));
  const auto c_stride = static_cast<ptrdiff_t>(p.c.stride() * sizeof(float));
  for (int n = 0; n < p.N; n += kTileBlock) {
    for (int m = 0; m < p.M; m += kTileBlock) {
      // Tiles 0 to 3 are C; 4 and 5 are A above and below; 6 and 7 are B left and right.
      Tiles::template Zero<0>();
      Tiles::template Zero<1>();
      Tiles::template Zero<2>();
      Tiles::template Zero<3>();
      for (int k = 0; k < p.K; k += kTile) {
        const uint32_t* a = p.a + m * p.a_m + k;
        const uint32_t* b = &p.b(k, n);
        Tiles::template Load<4>(a, a_stride);
        Tiles::template Load<5>(a + kTile * p.a_m, a_stride);
        Tiles::template Load<6>(b, b_stride);
        Tiles::template Load<7>(b + kTile, b_stride);
        Tiles::template Dot<0, 4, 6>();
        Tiles::template Dot<1, 4, 7>();
        Tiles::template Dot<2, 5, 6>();
        Tiles::template Dot<3, 5, 7>();
      }
      float* c = &p.c(m, n);
      Tiles::template Store<0>(c, c_stride);
      Tiles::template Store<1>(c + kTile, c_stride);
      Tiles::template Store<2>(c + kTile * p.c.stride(), c_stride);
      Tiles::template Store<3>(c + kTile * p.c.stride() + kTile, c_stride);
    }
  }
}

}  // namespace upswing
