#pragma once

#include <cstdint>
#include <memory>
#include <span>
#include <vector>

#include "base/thread_tuner.h"
#include "nn/adam.h"
#include "rl/agent.h"
#include "rl/ppo/normalizer.h"
#include "rl/ppo/ppo_config.h"
#include "rl/ppo/rollout_buffer.h"
#include "rl/schedule.h"
#include "rl/trained_network.h"

/// Proximal policy optimisation (Schulman et al., 2017) with generalised advantages (Schulman et
/// al., 2016).
///
/// Symbols: s observation, a action, r ratio π(a|s)/π_old(a|s), A advantage, V value, R its target,
/// N environments, T steps of a rollout, B batch size, D observation size.
namespace upswing {

/// A PPO agent for N environments. It learns from rollouts of T steps, each in a few epochs of
/// shuffled minibatches.
class Ppo : public Agent {
 public:
  /// Takes settings that PpoConfig::Check accepts. Throws BadInput if actions are levels but the
  /// task has several torques, or as CheckMirror does.
  Ppo(const PpoConfig& config, const EnvSpec& spec, uint64_t seed, ThreadPool& pool);

  void Act(Matrix<const float> obs, Matrix<double> action) override;
  void Observe(const StepResult& result) override;
  void Learn() override;
  Metrics TakeMetrics() override;
  std::unique_ptr<NetworkPolicy> ExportPolicy(PolicyInfo info) const override;
  void State(const Archive& archive) override;

  int64_t steps() const override { return steps_; }
  void Truncate(Matrix<const float> /*obs*/) override { rollout_.Truncate(); }
  int64_t updates() const override { return updates_; }
  /// Learning rate of the actor: the scheduled rate times the factor of the KL target.
  double learning_rate() const { return scheduled_rate() * rate_factor_; }
  std::span<const float> actor() const { return actor_.theta(); }
  std::span<const float> critic() const { return critic_.theta(); }
  std::span<const float> log_std() const { return log_std_; }
  const Normalizer& normalizer() const { return normalizer_; }

 private:
  /// Sums over some rows of a minibatch, or sums of minibatch means.
  struct Sums {
    double policy_loss = 0, value_loss = 0, entropy = 0, kl = 0, clipped = 0, norm = 0;
    AlignedVector<float> dlog_std;  // (A) gradient with respect to ln σ
    void Add(const Sums& other);
  };

  /// Draws the actions of some environments from the actor's outputs.
  void Sample(RowRange rows, Matrix<const float> outputs, Rng& rng, Matrix<double> action);
  /// Computes V (n) of observations (n × D).
  void Values(Matrix<const float> obs, std::span<float> values);
  /// Computes advantages and targets of the rollout.
  void Estimate();
  /// Makes a gradient step on the given rows (B) of the rollout.
  void Update(std::span<const int64_t> rows);
  /// Copies some rows of the minibatch from the rollout and normalises the observations.
  void Gather(std::span<const int64_t> from, RowRange rows);
  void BackwardActor(RowRange rows, Sums& sums);
  void BackwardCritic(RowRange rows, Sums& sums);
  /// Moves actor, ln σ and critic along their gradients.
  void Step(const Sums& sums);
  /// Clears the metric sums if they have been reported. Until the next rollout, reports repeat the
  /// sums of the last one.
  void BeginSums();
  void CountUpdate(const Sums& sums);
  /// Range of the KL target's factor for the learning rate.
  static constexpr Bounds<double> kRateFactor{1e-3, 10};
  /// Adapts the factor of the learning rate to KL(π_old ‖ π) of the last epoch.
  void AdaptRate(double kl);
  /// Current value of a setting that follows the schedule of the learning rate from `begin` to
  /// `end`.
  double Now(double begin, double end) const {
    return Scheduled(begin, end, steps_, config_.learning_rate_steps);
  }
  double scheduled_rate() const { return Now(config_.learning_rate, config_.learning_rate_end); }
  int64_t updates_due() const;
  /// Clamps ln σ to its range and computes σ.
  void SetStd();
  int outputs() const;  // number of outputs of the actor
  Matrix<float> BatchObs() { return {obs_.data(), B_, D_}; }
  Matrix<float> BatchActions() { return {action_.data(), B_, static_cast<int>(limit_.size())}; }

  PpoConfig config_;
  int D_, B_;
  std::vector<double> limit_;        // (A) N·m
  std::vector<double> torques_;      // (K) N·m; empty for continuous actions
  std::vector<float> mirror_signs_;  // (D)
  ThreadPool& pool_;
  ThreadTuner update_threads_;
  std::vector<Rng> explore_rngs_;  // one per block of environments
  Rng shuffle_rng_, mirror_rng_;

  TrainedNetwork actor_, critic_;
  AlignedVector<float> log_std_, std_;  // (A) ln σ, σ; for continuous actions
  Adam log_std_adam_;
  Normalizer normalizer_;
  double rate_factor_ = 1;

  RolloutBuffer rollout_;
  std::vector<int64_t> order_;                                    // (T·N) rows, shuffled
  AlignedVector<float> value_, next_value_, advantage_, target_;  // (T·N)
  Network::Activations act_activations_;                          // of N rows
  AlignedVector<float> act_obs_, act_outputs_;                    // (N × D), (N × outputs)

  // Buffers of a minibatch.
  AlignedVector<float> obs_, action_;     // (B × D) normalised, (B × A)
  AlignedVector<float> y_, dy_, V_, dV_;  // outputs (B × outputs), V (B), and their gradients
  AlignedVector<float> old_log_prob_, old_value_, batch_advantage_, batch_target_;  // (B)
  std::vector<uint8_t> mirrored_;                                                   // (B)
  std::vector<Sums> sums_;                                                          // one per slice

  int64_t steps_ = 0, updates_ = 0;
  // Metric sums since the first update after TakeMetrics. Each adds up the means of minibatches.
  bool reported_ = false;
  Sums report_;
  double explained_variance_ = 0;
  int64_t report_updates_ = 0;
};

}  // namespace upswing
