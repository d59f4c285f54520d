#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "base/archive.h"
#include "base/env.h"
#include "base/matrix.h"
#include "rl/replay/action_space.h"

namespace upswing {

/// T steps of N environments: row t · N + i is step t of environment i. D: observation size, A:
/// numbers of an action.
class RolloutBuffer {
 public:
  RolloutBuffer(int64_t steps, int num_envs, int obs_size, const ActionSpace& actions);

  int num_envs() const { return num_envs_; }  // N
  int64_t filled() const { return filled_; }  // steps so far
  bool full() const { return filled_ == steps_; }
  void Clear() { filled_ = 0; }
  /// Number of rows when full: T · N.
  int64_t size() const { return steps_ * num_envs_; }

  /// Space for the next step: observations (N × D), actions (N × A) and their ln π (N). Fill it
  /// before you call Add.
  Matrix<float> obs() { return Rows(obs_, obs_size_); }
  Matrix<float> action() { return Rows(action_, actions_.size); }
  std::span<float> log_prob() { return Rows(log_prob_, 1).values(); }

  /// Adds the result of the step. Multiplies rewards by `reward_scale`.
  void Add(const StepResult& result, double reward_scale);

  /// Marks the last step of each environment as truncated, unless it terminated.
  void Truncate();

  // The whole rollout, once it is full.
  Matrix<const float> all_obs() const { return All(obs_, obs_size_); }  // (T·N × D)
  /// (T·N × D) true successors
  Matrix<const float> all_next_obs() const { return All(next_obs_, obs_size_); }
  Matrix<const float> all_actions() const { return All(action_, actions_.size); }  // (T·N × A)
  Matrix<const float> log_probs() const { return Steps(log_prob_); }               // (T × N)
  Matrix<const float> rewards() const { return Steps(reward_); }                   // (T × N)
  Matrix<const uint8_t> terminated() const { return Steps(terminated_); }          // (T × N)
  Matrix<const uint8_t> truncated() const { return Steps(truncated_); }            // (T × N)

  /// Saves or loads the steps so far.
  void State(const Archive& archive);

 private:
  Matrix<float> Rows(std::vector<float>& values, int cols) {
    return {values.data() + filled_ * num_envs_ * cols, num_envs_, cols};
  }
  Matrix<const float> All(const std::vector<float>& values, int cols) const {
    return {values.data(), static_cast<int>(size()), cols};
  }
  template <typename T>
  Matrix<const T> Steps(const std::vector<T>& values) const {
    return {values.data(), static_cast<int>(steps_), num_envs_};
  }

  int64_t steps_;  // T
  int num_envs_, obs_size_;
  ActionSpace actions_;
  int64_t filled_ = 0;
  std::vector<float> obs_, next_obs_, action_;   // (T·N × D), (T·N × D), (T·N × A)
  std::vector<float> log_prob_, reward_;         // (T·N)
  std::vector<uint8_t> terminated_, truncated_;  // (T·N)
};

}  // namespace upswing
