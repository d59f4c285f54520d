#pragma once

#include <algorithm>
#include <span>

#include "base/thread_pool.h"
#include "nn/layer.h"

/// Slices of a minibatch that threads share.
namespace upswing {

/// Rows per slice of a minibatch of B rows, except in the last slice. A minibatch has enough slices
/// for a few threads, and a slice has whole kernel tiles. The number depends only on B, so that the
/// number of threads changes no bit.
inline int SliceRows(int B) {
  constexpr int kTile = 8;
  return std::clamp((B / 4 + kTile - 1) / kTile * kTile, kTile, 32);
}

/// Number of slices. A rest of less than half a slice belongs to the last slice.
inline int NumSlices(int B) {
  const int rows = SliceRows(B);
  return std::max(1, (B + (rows + 1) / 2) / rows);
}

/// Calls `work(RowRange)` for each slice of B rows. The threads of the pool share the slices.
template <typename Work>
void ForSlices(ThreadPool& pool, int B, const Work& work) {
  const int slices = NumSlices(B), rows = SliceRows(B);
  pool.ParallelFor(slices, [&](int slice) {
    const int first = slice * rows;
    work(RowRange{first, slice + 1 < slices ? rows : B - first});
  });
}

/// The part of an array (B) that belongs to `rows`.
template <typename Values>
auto Part(Values& values, RowRange rows) {
  return std::span(values).subspan(rows.first, rows.count);
}

}  // namespace upswing
