#pragma once

#include <cstdint>
#include <memory>
#include <span>
#include <vector>

#include "base/thread_pool.h"
#include "nn/adam.h"
#include "nn/gaussian.h"
#include "rl/off_policy.h"
#include "rl/sac/sac_config.h"
#include "rl/trained_network.h"

/// Soft Actor-Critic (Haarnoja et al., 2018, "Algorithms and Applications") and its extensions,
/// each a flag.
///
/// Symbols: s observation, a action in units of its limit, r reward, γ discount, α temperature,
/// π policy, Q1 and Q2 critics, Q' their targets, y target, B batch size, D observation size, A
/// action size, N environments.
namespace upswing {

/// Soft targets y (B) = r + discount · (min(Q1', Q2') - α ln π(a'|s')) with a' ~ π(s') (Eq 3 and
/// 5). All arrays are (B). The discount is γⁿ, or 0 after a termination. Over n steps, only the
/// last step has an entropy term, and the rewards come from the policy that acted.
void SoftTargets(std::span<const float> q1, std::span<const float> q2,
                 std::span<const float> log_prob, double alpha, std::span<const float> reward,
                 std::span<const float> discount, std::span<float> y);

/// Gradient of -ln α · (ln π + H) with respect to ln α, where H is the target entropy (Eq 18, with
/// ln α for α). It is below 0 while the policy's entropy -ln π is below H, so that α rises. ln α
/// stays within ±kMostLogAlpha.
inline double TemperatureGradient(double mean_log_prob, double target_entropy) {
  return -(mean_log_prob + target_entropy);
}

inline constexpr float kMostLogAlpha = 20;

/// An SAC agent for N environments.
class Sac : public OffPolicyAgent {
 public:
  /// Throws BadInput if the config mirrors minibatches but the task has no mirror symmetry.
  Sac(const SacConfig& config, const EnvSpec& spec, uint64_t seed, ThreadPool& pool);

  void Act(Matrix<const float> obs, Matrix<double> action) override;
  void Observe(const StepResult& result) override;
  void Learn() override;
  Metrics TakeMetrics() override;
  std::unique_ptr<NetworkPolicy> ExportPolicy(PolicyInfo info) const override;
  bool StartFrom(const NetworkPolicyParts& policy) override {
    return actor_.StartFrom(policy, ActionRule::kSquashedGaussian, {theta_policy_});
  }
  void State(const Archive& archive) override;

  double alpha() const;
  std::span<const float> actor() const { return actor_.theta(); }
  std::span<const float> critic(size_t i) const { return critics_.at(i).network.theta(); }
  /// Makes one update on the given minibatch: a step of the critics, and every actor_period updates
  /// a step of actor and temperature.
  void Update(const Minibatch& batch);

 private:
  struct Critic {
    TrainedNetwork network;
    AlignedVector<float> target;     // (num_parameters) Polyak average of the parameters
    AlignedVector<float> value, dy;  // (B) outputs and the gradient of the loss
    AlignedVector<float> loss;       // (B) loss times the transition's weight
    AlignedVector<float> dinputs;    // (B × (D + A)) dQ/d(s, a), for the actor
  };

  /// Action samples by component; see SquashSamples.
  struct Samples {
    AlignedVector<float> mean, log_std, epsilon, deviation, action, log_prob;
  };

  /// Penalty on the change of the mean action of environment `env` (smoothness), in units of the
  /// reward for learning.
  double RoughnessOf(const StepResult& result, size_t env);
  /// Samples a ~ π(s) for some rows. Writes samples_, log_prob_ and the rows (s, a) of `inputs` (B
  /// × (D + A)).
  void SampleRows(Matrix<const float> obs, RowRange rows, Matrix<float> inputs);
  void CriticRows(const Minibatch& batch, RowRange rows);
  void ActorRows(const Minibatch& batch, RowRange rows);
  void UpdateCritics(const Minibatch& batch);
  /// Shifts the values of each critic by reward centering.
  void CenterCritics(const Minibatch& batch);
  void UpdateActor(const Minibatch& batch);
  void UpdateTemperature();
  /// Adds a minibatch to the metrics and sets td_error_.
  void CountMinibatch();
  /// Draws the noise of samples_.
  void DrawNoise();
  static size_t Size(int rows, int cols) { return static_cast<size_t>(rows) * cols; }
  size_t num_critics() const { return config_.twin ? 2 : 1; }

  const OffPolicyConfig& off_policy() const override { return config_.off_policy; }

  SacConfig config_;
  int D_, A_, B_;
  std::vector<double> action_limit_;  // (A)
  Rng noise_rng_;

  TrainedNetwork actor_;
  AlignedVector<float> theta_policy_;  // Polyak average of the actor that is evaluated (policy_tau)
  std::vector<Critic> critics_;        // one or two
  AlignedVector<float> log_alpha_;     // (1)
  Adam alpha_adam_;

  // Buffers of an update, B rows.
  AlignedVector<float> actor_outputs_, actor_dy_;  // (B × 2 A)
  Samples samples_;                                // (B × A)
  AlignedVector<float> log_prob_;                  // (B) ln π(a|s)
  AlignedVector<float> inputs_, policy_inputs_;    // (B × (D + A)) s, a; s, a ~ π
  AlignedVector<float> y_;                         // (B)

  Network::Activations act_activations_;
  AlignedVector<float> act_outputs_;     // (N × 2 A) outputs of the last Act
  std::vector<float> mean_, last_mean_;  // (N × A) mean actions of this and the last step
  std::vector<int64_t> begins_;          // (N) 1 in the first step of an episode

  // Metric sums since TakeMetrics.
  double entropy_sum_ = 0;
  int64_t report_actor_updates_ = 0;
};

}  // namespace upswing
