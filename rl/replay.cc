#include "rl/replay.h"

#include <algorithm>
#include <cmath>

#include "core/text.h"

namespace upswing {

Minibatch::Minibatch(int size, int obs_size)
    : obs(static_cast<size_t>(size) * static_cast<size_t>(obs_size)),
      next_obs(obs.size()),
      action(static_cast<size_t>(size)),
      reward(action.size()),
      discount(action.size()) {}

Replay::Replay(int64_t capacity, int obs_size)
    : capacity_(capacity), obs_size_(static_cast<size_t>(obs_size)) {}

void Replay::Add(const Transition& t) {
  if (size() < capacity_) rows_.resize(rows_.size() + row_size());
  float* row = rows_.data() + static_cast<size_t>(next_) * row_size();
  row = std::ranges::copy(t.obs, row).out;
  row = std::ranges::copy(t.next_obs, row).out;
  row[0] = static_cast<float>(t.action);
  row[1] = t.reward;
  row[2] = t.discount;
  next_ = (next_ + 1) % capacity_;
}

Transition Replay::at(int64_t index) const {
  const auto row = std::span(rows_).subspan(static_cast<size_t>(index) * row_size(), row_size());
  const auto scalars = row.subspan(2 * obs_size_);
  return {row.first(obs_size_), row.subspan(obs_size_, obs_size_), static_cast<int>(scalars[0]),
          scalars[1], scalars[2]};
}

void Replay::Sample(Rng& rng, Minibatch& batch) const {
  for (size_t i = 0; i < batch.action.size(); ++i) {
    const Transition t = at(static_cast<int64_t>(rng.Below(static_cast<uint64_t>(size()))));
    std::ranges::copy(t.obs, batch.obs.data() + i * obs_size_);
    std::ranges::copy(t.next_obs, batch.next_obs.data() + i * obs_size_);
    batch.action[i] = t.action;
    batch.reward[i] = t.reward;
    batch.discount[i] = t.discount;
  }
}

void Replay::State(const Archive& archive, int num_actions) {
  archive.Scalar("next", next_);
  archive.Vector("rows", rows_, static_cast<size_t>(capacity_) * row_size());
  archive.Check(rows_.size() % row_size() == 0, "rows", "whole transitions");
  // Until the memory is full, the next place is behind the last.
  const bool full = size() == capacity_;
  archive.Check(full ? next_ >= 0 && next_ < capacity_ : next_ == size(), "next",
                "a place to write to");
  if (!archive.loading()) return;
  const auto valid = [&](float a) { return a >= 0 && a < num_actions && a == std::trunc(a); };
  for (size_t action = 2 * obs_size_; action < rows_.size(); action += row_size()) {
    archive.Check(valid(rows_[action]), "rows", Concat("actions from 0 to ", num_actions - 1));
  }
}

}  // namespace upswing
