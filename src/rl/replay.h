#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "base/aligned.h"
#include "base/archive.h"
#include "base/matrix.h"
#include "base/rng.h"
#include "base/thread_pool.h"
#include "nn/layer.h"
#include "rl/sum_tree.h"

namespace upswing {

/// Description of an agent's actions: `size` numbers within bounds. A discrete action is one
/// number, the index of the action.
struct ActionSpace {
  int size = 1;  // A
  Bounds<float> bounds{-1, 1};
  bool whole = false;  // whether only integers are allowed

  /// The discrete actions 0 … count - 1.
  static ActionSpace Discrete(size_t count) {
    return {1, {0, static_cast<float>(count - 1)}, true};
  }
  /// Throws BadInput about the tensor `name` unless all `actions` (… × A) are in this space.
  void Check(const Archive& archive, std::string_view name, std::span<const float> actions) const;
};

/// A transition over one or more steps. Its target is y = reward + discount · V(next_obs).
struct Transition {
  std::span<const float> obs;       // (D)
  std::span<const float> next_obs;  // (D)
  std::span<const float> action;    // (A)
  float reward = 0;                 // Σ γᵏ r over the steps
  float discount = 0;               // γ to the number of steps; 0 if the last step terminated
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

/// Mirrors a random half of a minibatch. Observations are multiplied by `signs` (D). An action is
/// reflected at the middle of its bounds, so that its torque changes sign.
void MirrorHalf(Rng& rng, std::span<const float> signs, const ActionSpace& actions,
                Minibatch& batch);

/// Replay memory of the newest `capacity` transitions (Lin, 1992). A row of 2 D + A + 2 floats
/// holds a whole transition, so that sampling it touches one place in memory. A million transitions
/// with D = 8 and A = 1 take 76 MB. Memory is allocated as it fills.
///
/// Sampling is uniform, or by priorities (proportional prioritisation; Schaul et al., 2016).
class Replay {
 public:
  Replay(int64_t capacity, int obs_size, ActionSpace actions, bool prioritized = false);

  int64_t size() const { return static_cast<int64_t>(rows_.size() / row_size()); }
  int64_t capacity() const { return capacity_; }

  /// Adds a transition. A full memory drops its oldest transition.
  void Add(const Transition& transition);

  /// Fills the minibatch with transitions drawn uniformly, with replacement. Needs size() > 0.
  void Sample(Rng& rng, Minibatch& batch) const;

  /// Draws transition i with P(i) = p_i / Σ p, one from each of B equal parts of the sum. Its
  /// weight is (N · P(i))^-β with N = size(), divided by the largest such weight in the minibatch
  /// (Section 3.4). `beta` is β.
  void SamplePrioritized(Rng& rng, double beta, ThreadPool& pool, Minibatch& batch) const;

  /// Sets the priorities of the minibatch's transitions to p = (|TD error| + 1e-6)^α, the paper's
  /// p^α (Section 3.3); `alpha` is α. A new transition gets the largest priority so far.
  void Prioritize(const Minibatch& batch, std::span<const float> td_error, double alpha);
  /// Priority p of the transition at a place below size(). Only for prioritised replay.
  double priority(int64_t index) const { return priorities_->at(index); }

  /// The transition at a place below size().
  Transition at(int64_t index) const;

  /// Saves or loads the memory.
  void State(const Archive& archive);

 private:
  size_t row_size() const { return 2 * obs_size_ + action_size() + 2; }
  size_t action_size() const { return static_cast<size_t>(actions_.size); }  // A
  /// Copies the transitions at batch.index into the given rows of the minibatch.
  void Gather(RowRange rows, Minibatch& batch) const;

  int64_t capacity_;
  size_t obs_size_;
  ActionSpace actions_;
  int64_t next_ = 0;         // place of the next transition
  std::vector<float> rows_;  // (size × row_size): obs, next_obs, action, reward, discount
  std::optional<SumTree> priorities_;
  double largest_priority_ = 1;  // largest priority so far
};

}  // namespace upswing
