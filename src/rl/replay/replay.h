#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "base/aligned.h"
#include "base/archive.h"
#include "base/rng.h"
#include "base/thread_pool.h"
#include "nn/layer.h"
#include "rl/replay/action_space.h"
#include "rl/replay/sum_tree.h"

/// Replay memory (Lin, 1992). B batch size, D observation size, A components of an action (DQN: 1).
namespace upswing {

/// A transition (s, a, r, s') over n ≥ 1 steps. Its TD target is y = r + discount · V(s').
struct Transition {
  std::span<const float> obs;       // (D) s
  std::span<const float> next_obs;  // (D) s'
  std::span<const float> action;    // (A) a; of a discrete agent its index
  double reward = 0;                // Σ γᵏ rₖ over k = 0 … n - 1
  double discount = 0;              // γⁿ; 0 if s' is terminal
};

/// A minibatch: row i of each array belongs to one transition.
struct Minibatch {
  AlignedVector<float> obs, next_obs;     // (B × D)
  AlignedVector<float> action;            // (B × A)
  AlignedVector<float> reward, discount;  // (B)
  std::vector<int64_t> index;             // (B) places in the replay memory
  AlignedVector<float> weight;            // (B) importance-sampling weights, at most 1

  Minibatch(int size, int obs_size, int action_size = 1);
  int size() const { return static_cast<int>(reward.size()); }  // B
};

/// The newest `capacity` transitions. Each is one contiguous row of numbers, so that a draw touches
/// one place in memory.
class Replay {
 public:
  Replay(int64_t capacity, int obs_size, ActionSpace actions, bool prioritized = false);

  int64_t size() const { return static_cast<int64_t>(rows_.size() / row_size()); }
  int64_t capacity() const { return capacity_; }
  /// The transition at a place below size().
  Transition at(int64_t index) const;

  /// Adds a transition. A full memory drops its oldest transition.
  void Add(const Transition& transition);
  /// Fills the minibatch with transitions drawn uniformly, with replacement. Needs size() > 0.
  void Sample(Rng& rng, Minibatch& batch) const;

  // Prioritised replay (Schaul et al., 2016), in prioritized_replay.cc.
  /// Draws transition i with P(i) = p_i / Σ p, one from each of B equal parts of Σ p. Its weight is
  /// w_i / max w, where w_i = (N · P(i))^-β, N = size(), and the maximum is over the minibatch
  /// (Section 3.4).
  void SamplePrioritized(Rng& rng, double beta, ThreadPool& pool, Minibatch& batch) const;
  /// Sets the priorities of the minibatch's transitions to p = (|TD error| + 1e-6)^α (Section 3.3).
  /// A new transition gets the largest priority so far.
  void Prioritize(const Minibatch& batch, std::span<const float> td_error, double alpha);
  /// Priority p of the transition at a place below size().
  double priority(int64_t index) const { return priorities_->at(index); }

  /// Saves or loads the memory.
  void State(const Archive& archive);

 private:
  size_t row_size() const { return 2 * obs_size_ + action_size() + 2; }
  size_t action_size() const { return static_cast<size_t>(actions_.size); }  // A
  /// Copies the transitions at batch.index into the given rows of the minibatch.
  void Gather(RowRange rows, Minibatch& batch) const;

  int64_t capacity_;
  size_t obs_size_;  // D
  ActionSpace actions_;
  int64_t next_ = 0;         // place of the next transition
  std::vector<float> rows_;  // (size × row_size) s, s', a, r, discount
  std::optional<SumTree> priorities_;
  double largest_priority_ = 1;  // largest priority so far
};

}  // namespace upswing
