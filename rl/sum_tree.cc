#include "rl/sum_tree.h"

#include <algorithm>
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
    // To the right, unless rounding alone leads there.
    if (mass >= nodes_[node] && nodes_[node + 1] > 0) {
      mass -= nodes_[node];
      ++node;
    }
  }
  return static_cast<int64_t>(node - leaves_);
}

void SumTree::State(const Archive& archive, int64_t count) {
  const auto numbers = std::span(nodes_).subspan(leaves_, static_cast<size_t>(count));
  archive.Array("numbers", numbers);
  archive.Check(std::ranges::all_of(numbers, [](double x) { return x > 0; }), "numbers",
                "numbers above 0");
  if (!archive.loading()) return;
  for (size_t node = leaves_ - 1; node > 0; --node) {
    nodes_[node] = nodes_[2 * node] + nodes_[2 * node + 1];
  }
}

}  // namespace upswing
