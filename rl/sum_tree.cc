#include "rl/sum_tree.h"

#include <bit>
#include <span>

namespace upswing {

SumTree::SumTree(int64_t capacity)
    : leaves_(std::bit_ceil(static_cast<size_t>(capacity))), nodes_(2 * leaves_) {}

void SumTree::Set(int64_t index, double value) {
  size_t node = leaves_ + static_cast<size_t>(index);
  nodes_[node] = value;
  while (node > 1) {
    node /= 2;
    nodes_[node] = nodes_[2 * node] + nodes_[2 * node + 1];
  }
}

int64_t SumTree::Find(double mass) const {
  size_t node = 1;
  while (node < leaves_) {
    node *= 2;
    // To the right, unless rounding alone leads there. Without a branch, as it could not be
    // predicted.
    const double left = nodes_[node];
    const bool right = (mass >= left) & (nodes_[node + 1] > 0);
    mass -= right ? left : 0;
    node += right ? 1 : 0;
  }
  return static_cast<int64_t>(node - leaves_);
}

void SumTree::State(const Archive& archive, int64_t count, Bounds<double> bounds) {
  const auto numbers = std::span(nodes_).subspan(leaves_, static_cast<size_t>(count));
  archive.Array("numbers", numbers, bounds);
  if (!archive.loading()) return;
  for (size_t node = leaves_ - 1; node > 0; --node) {
    nodes_[node] = nodes_[2 * node] + nodes_[2 * node + 1];
  }
}

}  // namespace upswing
