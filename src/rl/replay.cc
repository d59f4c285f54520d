#include "rl/replay.h"

#include <algorithm>
#include <cmath>

#include "base/text.h"
#include "rl/slices.h"

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

Minibatch::Minibatch(int size, int obs_size, int action_size)
    : obs(static_cast<size_t>(size) * obs_size),
      next_obs(obs.size()),
      action(static_cast<size_t>(size) * action_size),
      reward(size),
      discount(reward.size()),
      index(reward.size()),
      weight(reward.size(), 1.0F) {}

void MirrorHalf(Rng& rng, std::span<const float> signs, const ActionSpace& actions,
                Minibatch& batch) {
  const size_t D = signs.size();
  const auto A = static_cast<size_t>(actions.size);
  const float sum = actions.bounds.lowest + actions.bounds.highest;
  for (size_t i = 0; i < batch.reward.size(); ++i) {
    if (rng.Below(2) == 0) continue;
    for (size_t j = 0; j < D; ++j) {
      batch.obs[i * D + j] *= signs[j];
      batch.next_obs[i * D + j] *= signs[j];
    }
    for (float& a : std::span(batch.action).subspan(i * A, A)) a = sum - a;
  }
}

Replay::Replay(int64_t capacity, int obs_size, ActionSpace actions, bool prioritized)
    : capacity_(capacity), obs_size_(obs_size), actions_(actions) {
  if (prioritized) priorities_.emplace(capacity);
}

void Replay::Add(const Transition& t) {
  if (size() < capacity_) rows_.resize(rows_.size() + row_size());
  float* row = rows_.data() + next_ * row_size();
  row = std::ranges::copy(t.obs, row).out;
  row = std::ranges::copy(t.next_obs, row).out;
  row = std::ranges::copy(t.action, row).out;
  row[0] = t.reward;
  row[1] = t.discount;
  if (priorities_) priorities_->Set(next_, largest_priority_);
  next_ = (next_ + 1) % capacity_;
}

Transition Replay::at(int64_t index) const {
  const auto row = std::span(rows_).subspan(static_cast<size_t>(index) * row_size(), row_size());
  const auto rest = row.subspan(2 * obs_size_);
  return {row.first(obs_size_), row.subspan(obs_size_, obs_size_), rest.first(action_size()),
          rest[action_size()], rest[action_size() + 1]};
}

void Replay::Gather(RowRange rows, Minibatch& batch) const {
  // Prefetch all rows instead of waiting for each, because the memory is larger than any cache.
  for (const int64_t index : Part(batch.index, rows)) {
    const float* row = rows_.data() + index * row_size();
    constexpr size_t kLine = 16;  // floats in a cache line
    for (size_t at = 0; at < row_size() + kLine; at += kLine) {
      __builtin_prefetch(row + std::min(at, row_size() - 1));
    }
  }
  for (int i = rows.first; i < rows.first + rows.count; ++i) {
    const Transition t = at(batch.index[i]);
    std::ranges::copy(t.obs, batch.obs.data() + i * obs_size_);
    std::ranges::copy(t.next_obs, batch.next_obs.data() + i * obs_size_);
    std::ranges::copy(t.action, batch.action.data() + i * action_size());
    batch.reward[i] = t.reward;
    batch.discount[i] = t.discount;
  }
}

void Replay::Sample(Rng& rng, Minibatch& batch) const {
  for (int64_t& index : batch.index) {
    index = static_cast<int64_t>(rng.Below(static_cast<uint64_t>(size())));
  }
  Gather({0, batch.size()}, batch);
  std::ranges::fill(batch.weight, 1.0F);
}

void Replay::SamplePrioritized(Rng& rng, double beta, ThreadPool& pool, Minibatch& batch) const {
  const size_t B = batch.reward.size();
  const double part = priorities_->total() / static_cast<double>(B);
  double smallest = largest_priority_;
  std::vector<double> masses(B);
  for (size_t i = 0; i < B; ++i) masses[i] = part * (static_cast<double>(i) + rng.Uniform());
  ForSlices(pool, batch.size(), [&](RowRange rows) {
    priorities_->Find(Part(masses, rows), Part(batch.index, rows));
    Gather(rows, batch);
  });
  for (const int64_t index : batch.index) smallest = std::min(smallest, priority(index));
  // N and Σ p cancel in the ratio to the largest weight, which belongs to the smallest priority.
  for (size_t i = 0; i < B; ++i) {
    batch.weight[i] = static_cast<float>(std::pow(smallest / priority(batch.index[i]), beta));
  }
}

void Replay::Prioritize(const Minibatch& batch, std::span<const float> td_error, double alpha) {
  for (size_t i = 0; i < td_error.size(); ++i) {
    const double p = std::pow(std::abs(td_error[i]) + 1e-6, alpha);
    largest_priority_ = std::max(largest_priority_, p);
    priorities_->Set(batch.index[i], p);
  }
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
