#pragma once

#include <memory>
#include <span>
#include <string>
#include <vector>

#include "core/aligned.h"
#include "core/matrix.h"
#include "core/policy.h"
#include "core/tensors.h"
#include "nn/network.h"

namespace upswing {

/// How a network's outputs choose an action. Names in files: NameOf.
enum class ActionRule {
  kLevels,            // a Q-value for each of the torques: that of the largest
  kSquashedGaussian,  // (μ, ln σ) of each component: limit · tanh(μ)
  kClippedGaussian,   // (μ, ln σ) of each component: limit · clamp(μ, -1, 1)
  kCategorical,       // a logit for each of the torques: that of the largest
};

/// Such as "levels" or "squashed-gaussian".
std::string NameOf(ActionRule rule);

/// What a network policy is made of. D: observation size, A: action size, Q: number of torques.
struct NetworkPolicyParts {
  ActionRule rule = ActionRule::kLevels;
  NetworkShape shape = {};                // D inputs, 2 A or Q outputs
  AlignedVector<float> parameters = {};   // of the network
  std::vector<double> torques = {};       // (Q) N·m; of Gaussians empty
  std::vector<double> action_limit = {};  // (A) N·m; of kLevels empty, and A is 1
  // A network that estimates the value of an observation, where the outputs are no values: its
  // inputs are D numbers, or D + A, with the action in units of its limit behind the observation.
  // No inputs: there is none.
  NetworkShape critic = {};
  AlignedVector<float> critic_parameters = {};

  /// Whether an action is one of the torques.
  bool chooses_torque() const {
    return rule == ActionRule::kLevels || rule == ActionRule::kCategorical;
  }
  int action_size() const {
    return rule == ActionRule::kLevels ? 1 : static_cast<int>(action_limit.size());
  }
};

/// Result of the checks on loading.
struct SelfCheck {
  bool has_checksum = false;  // a correct one: no bit has changed
  double error = 0;           // largest |difference| of the samples' outputs when recomputed
  double tolerance = 0;       // largest error that counts as rounding
};

/// The policy of a network: a Q-network's best action (DQN), or the middle of the distribution that
/// an actor learned (SAC, PPO). Stored in one `policy.safetensors` with its description, its
/// origin, and sample inputs and outputs that every load recomputes
/// (docs/reference/policy-format.md).
class NetworkPolicy : public Policy {
 public:
  /// Throws BadInput if the parts do not fit together.
  NetworkPolicy(NetworkPolicyParts parts, PolicyInfo info);

  const NetworkPolicyParts& parts() const { return parts_; }
  bool is_actor() const { return parts_.rule != ActionRule::kLevels; }

  std::string kind() const override { return is_actor() ? "actor" : "q-network"; }
  std::string description() const override;
  int obs_size() const override { return parts_.shape.inputs; }
  int action_size() const override { return parts_.action_size(); }
  const PolicyInfo& info() const override { return info_; }
  size_t num_parameters() const override { return parts_.parameters.size(); }

  /// Buffers of a forward pass, for any number of rows.
  std::unique_ptr<Memory> Start(int num_envs) const override;
  /// Of a dueling network by its advantages alone, whose largest is that of the Q-values up to
  /// rounding.
  void Act(Matrix<const float> obs, Matrix<double> action, Memory& memory) const override;

  /// Q-values (N × Q), or the critic's V (N × 1).
  int num_values() const override;
  void Values(Matrix<const float> obs, Matrix<float> values, Memory& memory) const override;
  Matrix<const double> value_actions() const override;

  bool has_spread() const override { return is_actor(); }
  void Spread(Matrix<const float> obs, Matrix<double> low, Matrix<double> high,
              Memory& memory) const override;

  /// How many numbers the network puts out for an observation: 2 A or Q.
  int num_outputs() const { return parts_.shape.outputs; }
  /// These (N × num_outputs).
  void Outputs(Matrix<const float> obs, Matrix<float> outputs, Memory& memory) const;
  /// The action (A) that these outputs choose, and the ends of an actor's spread.
  void Choose(std::span<const float> outputs, std::span<double> action) const;
  void Spread(std::span<const float> outputs, std::span<double> low, std::span<double> high) const;

  /// The layers of the network, and of the critic where there is one, for exports. Views of this
  /// policy.
  std::vector<LayerView> Layers() const { return network_.Views(parts_.parameters); }
  std::vector<LayerView> CriticLayers() const;

  /// The checks on loading.
  const SelfCheck& self_check() const { return self_check_; }

  /// The same with its parameters rounded to bfloat16, for a file of half the size.
  NetworkPolicy Rounded() const;

  /// What its file holds. Throws Failure if a parameter is not finite.
  Tensors ToTensors() const override;

  /// Reads and checks what a file holds: format, metadata, shapes, finite numbers, samples, and the
  /// checksum where it has one. A changed parameter that moves no output of the samples by more
  /// than rounding, say of a unit that none of them activates, is detected by the checksum alone.
  /// Takes memory in proportion to the file's size. Throws BadInput.
  static NetworkPolicy From(const Tensors& file);

 private:
  /// Component k of the action that a Gaussian's u (nn/gaussian.h) stands for.
  double Bounded(double u, size_t k) const;
  /// Recomputes the stored outputs from the stored inputs. Throws BadInput.
  void CheckSamples(const Tensors& file);

  NetworkPolicyParts parts_;
  Network network_;
  std::unique_ptr<const Network> critic_;
  PolicyInfo info_;
  SelfCheck self_check_;
};

}  // namespace upswing
