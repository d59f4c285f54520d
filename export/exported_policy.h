#pragma once

#include <span>
#include <string>
#include <vector>

#include "core/env.h"
#include "core/error.h"
#include "nn/layer.h"
#include "setup/loaded_policy.h"

/// A learned policy taken apart, for what writes it in another form (ONNX, C): its networks as
/// lists of layers, and what goes in and comes out, in words.
namespace upswing {

/// One layer: y (out) = activation(norm(W x + b)), with x (in).
struct PlainLayer {
  std::string name;  // such as "feature.0"
  int in = 0, out = 0;
  std::vector<float> weight;           // W (out × in), row-major
  std::vector<float> bias;             // b (out)
  std::vector<float> gain, norm_bias;  // (out) of the layer normalisation; empty: there is none
  Activation activation = Activation::kNone;

  bool layer_norm() const { return !gain.empty(); }
};

/// ε of layer normalisation, as LayerNormForward has it.
inline constexpr float kLayerNormEpsilon = 1e-5F;

/// A network: features of its inputs, and outputs of the features. A dueling one has a value stream
/// beside them, and its Q-values are V + A - mean(A), where A are the outputs.
struct PlainNetwork {
  std::vector<PlainLayer> features, outputs, value;
};

/// How an action is made of the outputs.
enum class PolicyOutputKind { kLevels, kSquashedGaussian, kClippedGaussian, kCategorical };

/// A number that goes into a policy, or that an observation is made of.
struct NamedInput {
  std::string name;     // such as "w1"
  std::string meaning;  // such as "velocity of q1 over 10 rad/s"
};

struct ExportedPolicy {
  const LoadedPolicy* loaded = nullptr;
  EnvSpec spec;  // of its task
  PolicyOutputKind kind = PolicyOutputKind::kLevels;
  PlainNetwork network;
  PlainNetwork critic;                  // an actor's, if it has one
  std::vector<double> torques;          // those that it chooses from; empty: any within the limit
  double limit = 0;                     // no torque is beyond it, N·m
  double action_limit = 1;              // of an actor: the critic takes the torque over this
  std::vector<NamedInput> observation;  // (D)

  bool is_discrete() const { return !torques.empty(); }
  bool has_critic() const { return !critic.features.empty(); }
  /// Whether the critic takes the action's share of its limit behind the observation.
  bool critic_takes_action() const;
  int obs_size() const { return network.features.front().in; }
};

/// The largest size of some numbers; 0 of none.
double LargestSize(std::span<const double> values);

/// That the observations of a policy's task cannot be told elsewhere.
Error UnknownObservations(const LoadedPolicy& loaded);

/// Takes a policy apart, which has to outlive the result. Throws BadInput, with the path, if it is
/// none that was learned, or if its torques are beyond float.
ExportedPolicy TakeApart(const LoadedPolicy& loaded);

}  // namespace upswing
