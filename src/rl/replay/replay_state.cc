// Saved and loaded replay memories.
#include <algorithm>
#include <cmath>

#include "base/text.h"
#include "rl/replay/replay.h"

namespace upswing {
namespace {

// Range of (|TD error| + 1e-6)^α for α up to 1 and a TD error in float, with a margin for rounding.
constexpr Bounds<double> kPriorities{1e-7, 1e39};

}  // namespace

void ActionSpace::Check(const Archive& archive, std::string_view name,
                        std::span<const float> actions) const {
  const bool valid = std::ranges::all_of(actions, [&](float a) {
    return a >= bounds.lowest && a <= bounds.highest && (!whole || a == std::trunc(a));
  });
  if (valid) return;
  archive.Check(false, name,
                Concat(whole ? "whole numbers" : "actions", " from ", bounds.lowest, " to ",
                       bounds.highest, " as actions"));
}

void Replay::State(const Archive& archive) {
  archive.Scalar("next", next_, {0, capacity_ - 1});
  archive.Vector("rows", rows_, static_cast<size_t>(capacity_) * row_size());
  archive.Check(rows_.size() % row_size() == 0, "rows", "whole transitions");
  // Until the memory is full, the next place is the place after the last transition.
  const bool full = size() == capacity_;
  archive.Check(full || next_ == size(), "next", "the place after the last transition");
  if (priorities_) {
    archive.Scalar("largest_priority", largest_priority_, {1, kPriorities.highest});
    priorities_->State(archive.In("priorities"), size(), {kPriorities.lowest, largest_priority_});
  }
  if (!archive.loading()) return;
  for (size_t at = 2 * obs_size_; at < rows_.size(); at += row_size()) {
    actions_.Check(archive, "rows", std::span(rows_).subspan(at, action_size()));
    const float discount = rows_[at + action_size() + 1];
    archive.Check(discount >= 0 && discount <= 1, "rows", "discounts from 0 to 1");
  }
}

}  // namespace upswing
