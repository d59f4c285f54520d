#pragma once

#include <memory>
#include <span>
#include <string>
#include <vector>

#include "base/aligned.h"
#include "base/matrix.h"
#include "base/policy.h"
#include "base/tensors.h"
#include "nn/action_rule.h"
#include "nn/network.h"

namespace upswing {

/// Parts of a network policy. D: observation size, A: action size, Q: number of torques.
struct NetworkPolicyParts {
  ActionRule rule = ActionRule::kLevels;
  NetworkShape shape = {};                // D inputs, 2 A or Q outputs
  AlignedVector<float> parameters = {};   // parameters of the network
  std::vector<double> torques = {};       // (Q) N·m; if the rule chooses a torque, else empty
  std::vector<double> action_limit = {};  // (A) N·m; empty for Q-values, where A = 1
  // Network that estimates the value of an observation; only for rules whose outputs are not
  // values. It has D inputs, or D + A inputs: the observation, then the action in units of its
  // limit. No inputs: there is no critic.
  NetworkShape critic = {};
  AlignedVector<float> critic_parameters = {};

  /// The properties of the rule.
  const ActionRuleFacts& facts() const { return FactsOf(rule); }
  int action_size() const { return facts().is_actor() ? static_cast<int>(action_limit.size()) : 1; }
};

/// Result of the checks on loading a policy.
struct SelfCheck {
  bool has_checksum = false;  // whether the file has a checksum (a correct one)
  double error = 0;           // largest |difference| between stored and recomputed sample outputs
  double tolerance = 0;       // largest error that counts as rounding
};

/// The policy of a network: the best action of a Q-network (DQN), or the middle of the action
/// distribution of an actor (SAC, PPO). One `policy.safetensors` file stores it with its
/// description, its origin, and sample inputs and outputs (docs/reference/policy-format.md). Every
/// load recomputes the samples.
class NetworkPolicy : public Policy {
 public:
  /// Throws BadInput if the parts do not fit together.
  NetworkPolicy(NetworkPolicyParts parts, PolicyInfo info);

  const NetworkPolicyParts& parts() const { return parts_; }
  bool is_actor() const { return parts_.facts().is_actor(); }

  std::string kind() const override { return is_actor() ? "actor" : "q-network"; }
  std::string description() const override;
  int obs_size() const override { return parts_.shape.inputs; }
  int action_size() const override { return parts_.action_size(); }
  const PolicyInfo& info() const override { return info_; }
  /// Adds the results of its evaluation to the description.
  void SetResult(double success_rate, double mean_return) {
    info_.success_rate = success_rate;
    info_.mean_return = mean_return;
  }
  size_t num_parameters() const override { return parts_.parameters.size(); }

  /// Makes buffers of a forward pass for any number of rows.
  std::unique_ptr<Memory> Start(int num_envs) const override;
  /// Writes the chosen actions. For a dueling network it compares only the advantages. Their argmax
  /// is that of the Q-values up to rounding.
  void Act(Matrix<const float> obs, Matrix<double> action, Memory& memory) const override;

  /// Number of values: Q for Q-values (N × Q), or 1 for the critic's V (N × 1).
  int num_values() const override;
  void Values(Matrix<const float> obs, Matrix<float> values, Memory& memory) const override;
  Matrix<const double> value_actions() const override;

  bool has_spread() const override { return is_actor(); }
  void Spread(Matrix<const float> obs, Matrix<double> low, Matrix<double> high,
              Memory& memory) const override;

  /// Number of network outputs per observation: 2 A or Q.
  int num_outputs() const { return parts_.shape.outputs; }
  /// Writes the network outputs (N × num_outputs).
  void Outputs(Matrix<const float> obs, Matrix<float> outputs, Memory& memory) const;
  /// Computes the action (A) that the outputs choose, and the ends of an actor's spread.
  void Choose(std::span<const float> outputs, std::span<double> action) const;
  void Spread(std::span<const float> outputs, std::span<double> low, std::span<double> high) const;

  /// Views of the layers of the network, and of the critic if there is one, for exports. They refer
  /// to this policy.
  std::vector<LayerView> Layers() const { return network_.Views(parts_.parameters); }
  std::vector<LayerView> CriticLayers() const;

  /// Result of the checks on loading.
  const SelfCheck& self_check() const { return self_check_; }

  /// A copy whose torques and limits are `factor` times as large, with another description.
  NetworkPolicy WithTorques(double factor, PolicyInfo info) const;

  /// A copy with parameters rounded to bfloat16, for a file of half the size.
  NetworkPolicy Rounded() const;

  /// The contents of the policy file. Throws Failure if a parameter is not finite.
  Tensors ToTensors() const override;

  /// Reads a policy from a file's contents. Checks format, metadata, shapes, finite numbers,
  /// samples, and the checksum if there is one. Memory is proportional to the file's size. Throws
  /// BadInput.
  ///
  /// Some changed parameters move no sample output by more than rounding, such as a parameter of a
  /// unit that no sample activates. Only the checksum detects them.
  static NetworkPolicy From(const Tensors& file);

 private:
  /// Component k of the action for a Gaussian's u (nn/gaussian.h).
  double Bounded(double u, size_t k) const;
  /// Recomputes the stored outputs from the stored inputs. Throws BadInput if they differ.
  void CheckSamples(const Tensors& file);

  NetworkPolicyParts parts_;
  Network network_;
  std::unique_ptr<const Network> critic_;
  PolicyInfo info_;
  SelfCheck self_check_;
};

}  // namespace upswing
