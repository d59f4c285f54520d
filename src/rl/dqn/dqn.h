#pragma once

#include <cstdint>
#include <memory>
#include <span>
#include <vector>

#include "rl/dqn/dqn_config.h"
#include "rl/off_policy.h"
#include "rl/trained_network.h"

/// Deep Q-Network (Mnih et al., 2015) and its extensions, each a flag.
///
/// Symbols: s observation, a action (index of a torque), r scaled reward, γ discount, θ online
/// parameters, θ⁻ target parameters, y TD target, w importance weight, B batch size, A number of
/// actions (but in replay.h A = 1, the index), D observation size, N environments.
namespace upswing {

/// TD targets y (B) = r + discount · evaluate(s', a*) with a* = argmax_a select(s', a); the
/// discount (B) is γⁿ, or 0 after a termination; Q-values are (B × A).
/// - DQN: select = evaluate = Q(s', ·; θ⁻), so that y = r + γ max_a Q(s', a; θ⁻).
/// - Double DQN: select = Q(s', ·; θ), evaluate = Q(s', ·; θ⁻) (van Hasselt et al., 2016, Eq 4).
void TdTargets(Matrix<const float> select, Matrix<const float> evaluate,
               std::span<const float> reward, std::span<const float> discount, std::span<float> y);

/// Huber loss with threshold 1: δ²/2 where |δ| ≤ 1, |δ| - 1/2 beyond.
float HuberLoss(float delta);
/// Derivative of the Huber loss: δ clipped to ±1.
float HuberGradient(float delta);

/// A DQN agent for N environments.
class Dqn : public OffPolicyAgent {
 public:
  /// Throws BadInput if the task has more than one torque, or if the config mirrors minibatches but
  /// the task has no mirror symmetry.
  Dqn(const DqnConfig& config, const EnvSpec& spec, uint64_t seed, ThreadPool& pool);

  void Act(Matrix<const float> obs, Matrix<double> action) override;  // (N × D), (N × 1) N·m
  void Observe(const StepResult& result) override;
  void Learn() override;
  /// Makes one gradient step on the given minibatch and adds it to the metrics.
  void Update(const Minibatch& batch);

  std::span<const float> online() const { return online_.theta(); }
  std::span<const float> target() const { return theta_target_; }
  double epsilon() const;  // ε, probability of a random action
  std::optional<UpdateExample> LastUpdate() const override;
  Metrics TakeMetrics() override;
  std::unique_ptr<NetworkPolicy> ExportPolicy(PolicyInfo info) const override;
  bool StartFrom(const NetworkPolicyParts& policy) override;
  void State(const Archive& archive) override;

 private:
  /// Computes the TD errors of some rows of a minibatch and backpropagates them to the activations.
  void BackwardRows(const Minibatch& batch, RowRange rows);
  /// Adds the minibatch of the last BackwardRows to the metrics.
  void CountMinibatch(const Minibatch& batch);

  // Extensions, in dqn_extensions.cc.
  /// Computes Q(σs, σ·; θ⁻) (B × A) for some rows of s (B × D), where σ is the mirror.
  void ForwardMirrored(Matrix<const float> s, RowRange rows, Matrix<float> q);
  /// Reward centering: shifts the values of all three sets of parameters; see CenteringShift.
  void CenterValues(const Minibatch& batch);
  /// Moves theta_policy_ towards θ by Polyak averaging.
  void AveragePolicy();

  const OffPolicyConfig& off_policy() const override { return config_.off_policy; }

  DqnConfig config_;
  int D_, B_;
  std::vector<double> torques_;  // (A) N·m

  TrainedNetwork online_;                             // θ, its gradient and Adam
  AlignedVector<float> theta_target_, theta_policy_;  // θ⁻; evaluated average of θ (policy_tau)
  // Buffers of an update, B rows.
  AlignedVector<float> q_, q_select_, q_target_, dq_;  // (B × A)
  AlignedVector<float> mirrored_;                      // (B × D) σs'
  AlignedVector<float> y_, q_taken_;                   // (B) targets, Q(s, a)
  Network::Activations act_activations_;
  AlignedVector<float> act_q_;  // (N × A) Q-values of the last Act; dueling: advantages
};

}  // namespace upswing
