#pragma once

#include <algorithm>
#include <span>

#include "core/thread_pool.h"
#include "nn/layer.h"

/// The slices of a minibatch that threads share.
namespace upswing {

/// Rows in a slice of a minibatch of B, but for the last one: enough slices for some threads, and
/// whole tiles of the kernels. From B alone, so that the number of threads changes no bit.
inline int SliceRows(int B) {
  constexpr int kTile = 8;
  return std::clamp((B / 4 + kTile - 1) / kTile * kTile, kTile, 32);
}

/// How many there are: a rest of less than half a slice belongs to the last one.
inline int NumSlices(int B) {
  const int rows = SliceRows(B);
  return std::max(1, (B + (rows + 1) / 2) / rows);
}

/// Calls `work(RowRange)` for each slice of B rows, shared by the pool's threads.
template <typename Work>
void ForSlices(ThreadPool& pool, int B, const Work& work) {
  const int slices = NumSlices(B), rows = SliceRows(B);
  pool.ParallelFor(slices, [&](int slice) {
    const int first = slice * rows;
    work(RowRange{first, slice + 1 < slices ? rows : B - first});
  });
}

/// The part of some numbers (B) that belongs to these rows.
template <typename Values>
auto Part(Values& values, RowRange rows) {
  return std::span(values).subspan(rows.first, rows.count);
}

}  // namespace upswing
