#pragma once

#include <cstdint>
#include <span>

#include "base/aligned.h"
#include "base/archive.h"

namespace upswing {

/// Numbers ≥ 0 with a binary tree of their sums. Setting a number and finding a partial sum take
/// O(log n) (Schaul et al., 2016, Appendix B.2.1).
///
/// Each sum is the sum of its two children. The same numbers therefore give the same bits in any
/// order of setting them.
class SumTree {
 public:
  /// A tree of `capacity` numbers, all 0.
  explicit SumTree(int64_t capacity);

  void Set(int64_t index, double value);
  double at(int64_t index) const { return nodes_[leaves_ + index]; }
  double total() const { return nodes_[1]; }

  /// For each mass, below total(), finds the index at which the running sum of the numbers first
  /// exceeds the mass. Never finds an index whose number is 0.
  void Find(std::span<const double> masses, std::span<int64_t> indices) const;

  /// Saves or loads the first `count` numbers.
  void State(const Archive& archive, int64_t count, Bounds<double> bounds);

 private:
  size_t leaves_;                // a power of two
  AlignedVector<double> nodes_;  // (2 · leaves): the root is 1, the children of i are 2i and 2i + 1
};

}  // namespace upswing
