#pragma once

#include <array>
#include <cstdint>
#include <memory>
#include <span>
#include <vector>

#include "core/thread_pool.h"
#include "nn/adam.h"
#include "nn/gaussian.h"
#include "rl/off_policy.h"
#include "rl/sac_config.h"
#include "rl/trained_network.h"
#include "rl/value_bins.h"

/// Soft Actor-Critic (Haarnoja et al., 2018, "Algorithms and Applications") and its extensions,
/// each a flag.
///
/// Symbols: s observation, a action in units of its limit, r reward, γ discount, α temperature,
/// π policy, Q1 and Q2 critics, Q' their targets, y target, B batch size, D observation size, A
/// action size, N environments.
namespace upswing {

/// Soft targets y (B) = r + discount · (min(Q1', Q2') - α ln π(a'|s')) with a' ~ π(s') (Eq 3 and
/// 5). Over n steps the entropy enters at the last one only, and rewards in between are those of
/// the policy that acted. discount is γⁿ, or 0 after a termination. All are (B).
void SoftTargets(std::span<const float> q1, std::span<const float> q2,
                 std::span<const float> log_prob, double alpha, std::span<const float> reward,
                 std::span<const float> discount, std::span<float> y);

/// The gradient with respect to ln α of -ln α · (ln π + H), H the target entropy (Eq 18, with ln α
/// for α): below 0, so that α rises, while the policy's entropy -ln π is below its target.
/// ln α is kept within ±kMostLogAlpha.
inline double TemperatureGradient(double mean_log_prob, double target_entropy) {
  return -(mean_log_prob + target_entropy);
}

inline constexpr float kMostLogAlpha = 20;

/// An SAC agent for N environments.
class Sac : public OffPolicyAgent {
 public:
  /// Throws BadInput if minibatches are to be mirrored but the task has no mirror symmetry.
  Sac(const SacConfig& config, const EnvSpec& spec, uint64_t seed, ThreadPool& pool);

  void Act(Matrix<const float> obs, Matrix<double> action) override;
  Metrics TakeMetrics() override;
  std::unique_ptr<Policy> ExportPolicy(PolicyInfo info) const override;
  void State(const Archive& archive) override;

  double alpha() const;
  std::span<const float> actor() const { return actor_.theta(); }
  std::span<const float> critic(size_t i) const { return critics_.at(i).network.theta(); }
  /// One round on a given minibatch: a step of the critics and, each actor_period, of actor and
  /// temperature.
  void Update(const Minibatch& batch) override;

 private:
  struct Critic {
    TrainedNetwork network;
    AlignedVector<float> target;       // its parameters' Polyak average, (num_parameters)
    AlignedVector<float> outputs, dy;  // (B × outputs) and the loss's gradient
    AlignedVector<float> value, loss;  // (B), the loss times the transition's weight
    AlignedVector<float> dinputs;      // (B × (D + A)) dQ/d(s, a), for the actor
  };

  /// Components of actions that were drawn; see SquashSamples.
  struct Samples {
    AlignedVector<float> mean, log_std, epsilon, deviation, action, log_prob;
  };

  /// Less what a change of the mean action costs; see smoothness.
  double RewardOf(const StepResult& result, size_t env) override;
  /// Samples a ~ π(s) of some rows: fills samples_, and behind `inputs`' (B × (D + A))
  /// observations the actions.
  void SampleRows(Matrix<const float> obs, RowRange rows, Matrix<float> inputs);
  void CriticRows(const Minibatch& batch, RowRange rows);
  void ActorRows(const Minibatch& batch, RowRange rows);
  void UpdateCritics(const Minibatch& batch);
  /// Shifts the values of each critic by reward centering.
  void CenterCritics(const Minibatch& batch);
  void UpdateActor(const Minibatch& batch);
  void UpdateTemperature();
  /// Q of some rows after their outputs: the output itself, or the mean of a categorical one.
  void ValueRows(Critic& critic, RowRange rows) const;
  /// Adds a minibatch to the metrics and writes td_error_.
  void CountMinibatch();
  /// Fills samples_' noise.
  void DrawNoise();
  static size_t Size(int rows, int cols) { return static_cast<size_t>(rows) * cols; }
  size_t num_critics() const { return config_.twin ? 2 : 1; }

  SacConfig config_;
  int D_, A_, B_;
  std::vector<double> action_limit_;  // (A)
  ValueBins bins_;
  Rng noise_rng_;

  TrainedNetwork actor_;
  AlignedVector<float> theta_policy_;  // Polyak average of the actor that is judged; see policy_tau
  std::vector<Critic> critics_;        // one or two
  AlignedVector<float> log_alpha_;     // (1)
  Adam alpha_adam_;

  // Of an update: B rows.
  AlignedVector<float> actor_outputs_, actor_dy_;  // (B × 2 A)
  Samples samples_;                                // (B × A)
  AlignedVector<float> log_prob_;                  // (B) ln π(a|s)
  AlignedVector<float> inputs_, policy_inputs_;    // (B × (D + A)): s, a; s, a ~ π
  AlignedVector<float> y_;                         // (B)

  Network::Activations act_activations_;
  AlignedVector<float> act_outputs_;     // (N × 2 A) of the last Act
  std::vector<float> mean_, last_mean_;  // (N × A) mean actions of this step and the last
  std::vector<int64_t> begins_;          // (N) 1 in the first step of an episode

  // Sums since TakeMetrics.
  double entropy_sum_ = 0;
  int64_t report_actor_updates_ = 0;
};

}  // namespace upswing
