#include "rl/replay/sum_tree.h"

#include <algorithm>
#include <array>
#include <bit>

namespace upswing {

SumTree::SumTree(int64_t capacity)
    : leaves_(std::bit_ceil(static_cast<size_t>(capacity))), nodes_(2 * leaves_) {}

void SumTree::Set(int64_t index, double value) {
  size_t node = leaves_ + index;
  nodes_[node] = value;
  for (; node > 1; node /= 2) {
    value += nodes_[node ^ 1];
    nodes_[node / 2] = value;
  }
}

void SumTree::Find(std::span<const double> masses, std::span<int64_t> indices) const {
  // Search for several masses together, level by level. Each step waits for memory, and the waits
  // then overlap.
  constexpr size_t kTogether = 16;
  for (size_t first = 0; first < masses.size(); first += kTogether) {
    const size_t count = std::min(kTogether, masses.size() - first);
    std::array<double, kTogether> mass{};
    std::array<size_t, kTogether> node{};
    std::copy_n(masses.begin() + static_cast<ptrdiff_t>(first), count, mass.begin());
    node.fill(1);
    for (size_t level = 1; level < leaves_; level *= 2) {
      for (size_t k = 0; k < kTogether; ++k) {
        node[k] *= 2;
        // Go right, unless only rounding leads there. Use no branch, because the processor could
        // not predict it.
        const double left = nodes_[node[k]];
        const uint64_t right = uint64_t{mass[k] >= left} & uint64_t{nodes_[node[k] + 1] > 0};
        // Subtracts left, or 0.
        mass[k] -= std::bit_cast<double>(std::bit_cast<uint64_t>(left) & -right);
        node[k] += right;
        // The eight descendants three levels below share a cache line.
        __builtin_prefetch(nodes_.data() + std::min(8 * node[k], leaves_));
      }
    }
    for (size_t k = 0; k < count; ++k) {
      indices[first + k] = static_cast<int64_t>(node[k] - leaves_);
    }
  }
}

void SumTree::State(const Archive& archive, int64_t count, Bounds<double> bounds) {
  const auto numbers = std::span(nodes_).subspan(leaves_, count);
  archive.Array("numbers", numbers, bounds);
  if (!archive.loading()) return;
  for (size_t node = leaves_ - 1; node > 0; --node) {
    nodes_[node] = nodes_[2 * node] + nodes_[2 * node + 1];
  }
}

}  // namespace upswing
