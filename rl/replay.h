#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "core/aligned.h"
#include "core/archive.h"
#include "core/matrix.h"
#include "core/rng.h"
#include "rl/sum_tree.h"

namespace upswing {

/// A transition over one or more steps, ready to learn from: y = reward + discount · V(next_obs).
struct Transition {
  std::span<const float> obs;       // (D)
  std::span<const float> next_obs;  // (D)
  int action = 0;
  float reward = 0;    // Σ γᵏ r over its steps
  float discount = 0;  // γ to the number of steps; 0 if the last one terminated
};

/// A minibatch, gathered: row i of each array is one transition.
struct Minibatch {
  AlignedVector<float> obs, next_obs;     // (B × D)
  std::vector<int> action;                // (B)
  AlignedVector<float> reward, discount;  // (B)
  std::vector<int64_t> index;             // (B) places in the memory that they came from
  AlignedVector<float> weight;            // (B) importance-sampling weights, at most 1

  Minibatch(int size, int obs_size);
};

/// Mirrors a random half of a minibatch: observations take `signs` (D), and action a becomes
/// A - 1 - a, the torque of the other sign.
void MirrorHalf(Rng& rng, std::span<const float> signs, int actions, Minibatch& batch);

/// Replay memory of the newest `capacity` transitions (Lin, 1992). One row of 2 D + 3 floats holds
/// a whole transition, so that sampling one touches one place in memory; a million of ours take
/// 76 MB. Memory is taken as it fills.
///
/// It draws uniformly, or by priorities (proportional prioritisation; Schaul et al., 2016).
class Replay {
 public:
  Replay(int64_t capacity, int obs_size, bool prioritized = false);

  int64_t size() const { return static_cast<int64_t>(rows_.size() / row_size()); }
  int64_t capacity() const { return capacity_; }

  /// Adds a transition; when full, in place of the oldest.
  void Add(const Transition& transition);

  /// Draws as many as the minibatch holds, uniformly and with replacement. Not for an empty memory.
  void Sample(Rng& rng, Minibatch& batch) const;

  /// Draws transition i with P(i) = p_i / Σ p, one from each of B equal parts of the sum. Its
  /// weight is (N · P(i))^-β, N = size(), over the largest of the minibatch (Section 3.4). `beta`
  /// is β.
  void SamplePrioritized(Rng& rng, double beta, Minibatch& batch) const;

  /// Sets the priorities of what a minibatch holds. Stored is p = (|TD error| + 1e-6)^α, the
  /// paper's p^α (Section 3.3); `alpha` is α. A new transition has the largest so far.
  void Prioritize(const Minibatch& batch, std::span<const float> td_error, double alpha);
  /// p of a place below size(); only of a memory with priorities.
  double priority(int64_t index) const { return priorities_->at(index); }

  /// The transition at a place below size().
  Transition at(int64_t index) const;

  /// Saves or loads what is stored; actions are below num_actions.
  void State(const Archive& archive, int num_actions);

 private:
  size_t row_size() const { return 2 * obs_size_ + 3; }
  /// Copies the transitions of batch.index into the minibatch.
  void Gather(Minibatch& batch) const;

  int64_t capacity_;
  size_t obs_size_;
  int64_t next_ = 0;         // where the next one goes
  std::vector<float> rows_;  // (size × row_size): obs, next_obs, action, reward, discount
  std::optional<SumTree> priorities_;
  double largest_priority_ = 1;  // so far
};

}  // namespace upswing
