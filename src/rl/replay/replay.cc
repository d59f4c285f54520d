// Replay memory (Lin, 1992). Symbols: see rl/replay/replay.h.
#include "rl/replay/replay.h"

#include <algorithm>

#include "rl/replay/slices.h"

namespace upswing {

Minibatch::Minibatch(int size, int obs_size, int action_size)
    : obs(static_cast<size_t>(size) * obs_size),
      next_obs(obs.size()),
      action(static_cast<size_t>(size) * action_size),
      reward(size),
      discount(reward.size()),
      index(reward.size()),
      weight(reward.size(), 1.0F) {}

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
  row[0] = static_cast<float>(t.reward);
  row[1] = static_cast<float>(t.discount);
  if (priorities_) priorities_->Set(next_, largest_priority_);
  next_ = (next_ + 1) % capacity_;
}

Transition Replay::at(int64_t index) const {
  const auto row = std::span(rows_).subspan(static_cast<size_t>(index) * row_size(), row_size());
  const auto rest = row.subspan(2 * obs_size_);
  return {row.first(obs_size_), row.subspan(obs_size_, obs_size_), rest.first(action_size()),
          rest[action_size()], rest[action_size() + 1]};
}

void Replay::Sample(Rng& rng, Minibatch& batch) const {
  for (int64_t& index : batch.index) {
    index = static_cast<int64_t>(rng.Below(static_cast<uint64_t>(size())));
  }
  Gather({0, batch.size()}, batch);
  std::ranges::fill(batch.weight, 1.0F);
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
    // Not std::ranges::copy: gcc 14 warns that it may copy a negative number of bytes.
    std::copy_n(t.obs.data(), obs_size_, batch.obs.data() + i * obs_size_);
    std::copy_n(t.next_obs.data(), obs_size_, batch.next_obs.data() + i * obs_size_);
    std::copy_n(t.action.data(), action_size(), batch.action.data() + i * action_size());
    batch.reward[i] = static_cast<float>(t.reward);
    batch.discount[i] = static_cast<float>(t.discount);
  }
}

}  // namespace upswing
