#pragma once

#include <vector>

#include "base/archive.h"
#include "base/matrix.h"
#include "rl/replay/replay.h"

namespace upswing {

/// Joins the steps of each environment into transitions over n steps (Sutton, 1988; Mnih et al.,
/// 2016, Section 4). At the end of an episode, the last steps become shorter transitions. The
/// discount of a transition is the product of its steps' discounts: γᵏ for k steps, or 0 if the
/// last one terminates.
class NStep {
 public:
  NStep(int num_envs, int n, int obs_size, ActionSpace actions);

  /// Adds one step of environment `env`, whose discount is γ, or 0 after a termination. Adds every
  /// transition that is now complete to `replay`. `done` ends the episode.
  void Push(int env, const Transition& step, bool done, Replay& replay);

  /// Ends the episode of environment `env` by a truncation at `next_obs` (D).
  void Truncate(int env, std::span<const float> next_obs, Replay& replay) {
    Complete(env, next_obs, true, replay);
  }

  /// Number of steps, over all environments, that are not yet part of a transition.
  int64_t waiting() const;

  /// Saves or loads the waiting steps.
  void State(const Archive& archive);

 private:
  /// Adds every complete transition of the waiting steps to `replay`; with `done` all of them.
  void Complete(int env, std::span<const float> next_obs, bool done, Replay& replay);

  /// The rows (n × anything) of environment `env` in an array of waiting steps.
  template <typename T>
  Matrix<T> Waiting(std::vector<T>& values, int env) {
    const auto size = static_cast<int>(values.size() / count_.size());
    return {values.data() + static_cast<size_t>(env) * size, n_, size / n_};
  }

  int n_;
  ActionSpace actions_;
  // The waiting steps of each environment, oldest first.
  std::vector<int64_t> count_;    // (N)
  std::vector<float> obs_;        // (N × n × D)
  std::vector<float> action_;     // (N × n × A)
  std::vector<double> reward_;    // (N × n)
  std::vector<double> discount_;  // (N × n) γ, or 0 after a termination
};

}  // namespace upswing
