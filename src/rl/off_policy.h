#pragma once

#include <cstdint>
#include <vector>

#include "base/thread_tuner.h"
#include "rl/agent.h"
#include "rl/off_policy_config.h"
#include "rl/replay/n_step.h"
#include "rl/replay/replay.h"

namespace upswing {

/// An agent that learns from a replay memory: the common part of DQN and SAC. A derived agent acts,
/// observes and learns with these parts.
///
/// Letters: N environments, D observation size, A numbers of an action, B batch size.
class OffPolicyAgent : public Agent {
 public:
  int64_t steps() const override { return steps_; }
  int64_t updates() const override { return updates_; }
  void Truncate(Matrix<const float> obs) override;

  const Replay& replay() const { return replay_; }
  double learning_rate() const;
  /// β of prioritised replay. It rises to 1 over learning_rate_steps (Schaul et al., 2016).
  double importance_exponent() const;

 protected:
  /// The settings. The derived agent holds them, so the constructor of this class must not call it.
  virtual const OffPolicyConfig& off_policy() const = 0;

  /// Throws BadInput if the config mirrors minibatches but the task has no mirror symmetry.
  OffPolicyAgent(const OffPolicyConfig& config, const EnvSpec& spec, const ActionSpace& actions,
                 uint64_t seed, ThreadPool& pool);

  /// Adds a step of environment `env` to the replay memory, joined with the steps that follow if
  /// n_step is above 1. The step's discount is γ, or 0 after a termination. `done` ends the
  /// episode.
  void Store(int env, const Transition& step, bool done);
  /// Whether an update is due: updates_per_step for each step after learning_starts.
  bool UpdateIsDue() const { return updates_ < updates_due(); }
  /// Draws a minibatch: uniformly, or by priority if prioritized. Mirrors half of it if `mirror`.
  const Minibatch& Sample();
  /// The minibatch of the last Sample.
  const Minibatch& batch() const { return batch_; }
  /// Sets the priorities of the last Sample from td_error_, if prioritized.
  void UpdatePriorities();
  /// Polyak rate of the evaluated policy: `tau` times the ratio of the current to the initial
  /// learning rate. As learning slows, the average covers more updates (Polyak and Juditsky, 1992).
  double AveragingTau(double tau) const;
  /// Shift of all values after a minibatch: reward_centering times the shift that makes the
  /// weighted mean error 0. `errors` is the weighted sum of Q(s, a) - y, clipped if the loss clips.
  ///
  /// Online and target values shift together, so that the target network's lag does not slow their
  /// common level. This is reward centering (Naik et al., 2024, Eq 12). Its average reward r̄ is
  /// (1 - γ) times the sum of all shifts.
  float CenteringShift(const Minibatch& batch, double errors) const;
  /// Adds a minibatch's mean loss, mean Q and mean |TD error| to the metrics. Throws Failure if the
  /// loss is not finite.
  void CountErrors(double loss, double q, double td_error);
  /// Adds the metrics of this base class: means since the last call.
  void TakeMeans(Metrics& metrics);
  /// Saves or loads the replay memory, random streams, counters and metric sums. Loading also
  /// throws BadInput if they contradict each other.
  void SharedState(const Archive& archive);

  ThreadPool& pool_;
  ThreadTuner update_threads_;
  Rng explore_rng_;
  std::vector<float> act_obs_;       // (N × D) s of the last Act
  std::vector<float> act_action_;    // (N × A) a of the last Act
  std::vector<float> mirror_signs_;  // (D) signs of the observations; empty: no mirror symmetry
  std::vector<float> td_error_;      // (B) of the last update: Q(s, a) - y, or its size
  int64_t steps_ = 0, episodes_ = 0, updates_ = 0;
  double norm_sum_ = 0;  // sum of the gradients' norms since TakeMeans

 private:
  int64_t updates_due() const;

  ActionSpace action_space_;
  Rng sample_rng_;
  Replay replay_;
  NStep n_step_;
  Minibatch batch_;
  double loss_sum_ = 0, q_sum_ = 0, td_sum_ = 0;  // sums since TakeMeans
  int64_t report_updates_ = 0;
};

}  // namespace upswing
