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
#include "nn/policy_file.h"

namespace upswing {

/// How an actor's outputs choose an action.
enum class ActorOutput {
  kSquashedGaussian,  // (μ, ln σ) of each component: limit · tanh(μ)
  kClippedGaussian,   // (μ, ln σ) of each component: limit · clamp(μ, -1, 1)
  kCategorical,       // a logit for each of the torques: that of the largest
};

/// What an actor policy is made of. D: observation size, A: action size, Q: number of torques.
struct ActorParts {
  ActorOutput output = ActorOutput::kSquashedGaussian;
  MlpShape actor;                    // D → hidden…, then a linear layer to 2 A or Q outputs
  std::vector<float> parameters;     // of the actor network
  std::vector<double> action_limit;  // (A) N·m
  std::vector<double> torques = {};  // (Q) N·m; of a categorical one, whose A is 1
  // A network that estimates the value of an observation: its inputs are D numbers, or D + A, with
  // the mean action in units of its limit behind the observation. No inputs: there is none.
  MlpShape critic = {};
  std::vector<float> critic_parameters = {};
};

/// Takes the action that an actor network thinks best, the middle of its distribution. Learned by
/// SAC or PPO. Stored as docs/policy-format.md says.
class ActorPolicy : public Policy {
 public:
  /// Throws BadInput if the parts do not fit together.
  ActorPolicy(ActorParts parts, PolicyInfo info);

  std::string kind() const override { return "actor"; }
  std::string description() const override;
  int obs_size() const override { return parts_.actor.inputs; }
  int action_size() const override { return static_cast<int>(parts_.action_limit.size()); }
  const PolicyInfo& info() const override { return info_; }
  size_t num_parameters() const override { return parts_.parameters.size(); }

  std::unique_ptr<Memory> Start(int num_envs) const override;
  void Act(Matrix<const float> obs, Matrix<double> action, Memory& memory) const override;

  /// V (N × 1), where there is a critic.
  int num_values() const override { return critic_ ? 1 : 0; }
  void Values(Matrix<const float> obs, Matrix<float> values, Memory& memory) const override;

  bool has_spread() const override { return true; }
  void Spread(Matrix<const float> obs, Matrix<double> low, Matrix<double> high,
              Memory& memory) const override;

  const ActorParts& parts() const { return parts_; }
  /// How many numbers the actor network puts out for an observation: 2 A or Q.
  int num_outputs() const;
  /// These (N × num_outputs).
  void Outputs(Matrix<const float> obs, Matrix<float> outputs, Memory& memory) const;

  /// The action (A) that these outputs choose, and the spread of those that they draw.
  void Choose(std::span<const float> outputs, std::span<double> action) const;
  void Spread(std::span<const float> outputs, std::span<double> low, std::span<double> high) const;

  /// The checks on loading.
  const SelfCheck& self_check() const { return self_check_; }

  /// What its file holds. Throws Failure if a parameter is not finite.
  Tensors ToTensors() const override;
  /// Reads and checks what a file holds, as QPolicy::From does. Throws BadInput.
  static ActorPolicy From(const Tensors& file);
  /// Whether the text of a file's metadata "output" is one of those above.
  static bool IsOutput(const std::string& text);

 private:
  /// Component k of the action that a Gaussian's u (nn/gaussian.h) stands for.
  double Bounded(double u, size_t k) const;
  void CheckFile(const Tensors& file);

  ActorParts parts_;
  Network<float> actor_;
  std::unique_ptr<const Network<float>> critic_;
  PolicyInfo info_;
  SelfCheck self_check_;
};

}  // namespace upswing
