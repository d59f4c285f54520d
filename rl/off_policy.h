#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "core/thread_tuner.h"
#include "rl/agent.h"
#include "rl/n_step.h"
#include "rl/off_policy_config.h"
#include "rl/replay.h"

namespace upswing {

/// An agent that learns from a replay memory: what DQN and SAC have in common. A derived agent acts
/// and makes one gradient step from a minibatch.
///
/// Letters: N environments, D observation size, A numbers of an action, B batch size.
class OffPolicyAgent : public Agent {
 public:
  void Observe(const StepResult& result) override;
  void Learn() override;
  int64_t steps() const override { return steps_; }
  int64_t updates() const override { return updates_; }

  const Replay& replay() const { return replay_; }
  double learning_rate() const;
  /// β of prioritised replay, which rises to 1 over learning_rate_steps (Schaul et al., 2016).
  double importance_exponent() const;
  /// One gradient step on a given minibatch, which counts in the metrics. Leaves td_error_ and
  /// counts updates_.
  virtual void Update(const Minibatch& batch) = 0;

 protected:
  /// Throws BadInput if minibatches are to be mirrored but the task has no mirror symmetry.
  OffPolicyAgent(const OffPolicyConfig& config, const EnvSpec& spec, const ActionSpace& actions,
                 uint64_t seed, ThreadPool& pool);

  /// What is learned from an environment's step: its reward times reward_scale.
  virtual double RewardOf(const StepResult& result, size_t env);
  /// The observations (N × D) that actions are now chosen for.
  void Remember(Matrix<const float> obs);
  /// Polyak rate of the policy that is judged: `tau` times the learning rate over that at the
  /// beginning. As learning slows, the average lengthens (Polyak and Juditsky, 1992).
  double AveragingTau(double tau) const;
  /// The shift of all values after a minibatch: reward_centering times the shift that makes the
  /// weighted mean error 0. `errors` is the weighted sum of Q(s, a) - y, clipped if the loss clips.
  /// Online and target values shift together, so that the target network's lag does not slow their
  /// common level. This is reward centering (Naik et al., 2024, Eq 12), whose average reward r̄ is
  /// (1 - γ) times the sum of all shifts.
  float CenteringShift(const Minibatch& batch, double errors) const;
  /// Adds the means over a minibatch of the loss, of Q and of |TD error| to the metrics. Throws
  /// Failure if the loss is not finite.
  void CountErrors(double loss, double q, double td_error);
  /// Adds the metrics of all such agents: the means since the last call.
  void TakeMeans(Metrics& metrics);
  /// Saves or loads memory, streams of random numbers, counters and the sums of the metrics. Throws
  /// BadInput, too, if they contradict each other.
  void SharedState(const Archive& archive);

  ThreadPool& pool_;
  Rng explore_rng_;
  std::vector<float> act_action_;    // (N × A) of the last Act
  std::vector<float> mirror_signs_;  // (D) of the observations; empty: no symmetry
  std::vector<float> td_error_;      // (B) of the last Update: Q(s, a) - y, or its size
  int64_t steps_ = 0, episodes_ = 0, updates_ = 0;
  double norm_sum_ = 0;  // of the gradients' norms since TakeMeans

 private:
  int64_t updates_due() const;
  /// Draws a minibatch.
  void SampleBatch();

  OffPolicyConfig settings_;
  ThreadTuner update_threads_;
  size_t obs_size_, action_size_;
  ActionSpace action_space_;
  Rng sample_rng_;
  Replay replay_;
  NStep n_step_;
  Minibatch batch_;
  std::vector<float> act_obs_;                    // (N × D) of the last Act
  double loss_sum_ = 0, q_sum_ = 0, td_sum_ = 0;  // since TakeMeans, of so many updates:
  int64_t report_updates_ = 0;
};

}  // namespace upswing
