#pragma once

#include <span>
#include <string>
#include <vector>

#include "agents/loaded_policy.h"
#include "base/env.h"
#include "nn/network_policy.h"

/// A learned policy as the exports to ONNX and C need it: its layers, and descriptions of its
/// inputs and outputs.
namespace upswing::deploy {

/// ε of layer normalisation, equal to that of LayerNormForward.
inline constexpr float kLayerNormEpsilon = 1e-5F;

/// A component of a policy's input or state.
struct NamedInput {
  std::string name;     // such as "w1"
  std::string meaning;  // such as "velocity of q1 over 10 rad/s"
};

/// The exports' description of a task, and the file of extras/deploy/c that computes its
/// observation.
struct ExportedTask {
  std::string file;
  std::string goal;                     // purpose of a policy
  std::string motor;                    // where the torque acts
  std::vector<NamedInput> state;        // (S)
  std::vector<NamedInput> observation;  // (D)
};

/// The double pendulum as the policy observes it.
ExportedTask PendulumTask(const LoadedPolicy& loaded);

struct ExportedPolicy {
  const LoadedPolicy* loaded = nullptr;
  const NetworkPolicy* policy = nullptr;  // of `loaded`
  std::vector<LayerView> layers;          // of the policy's network; see Network::Views
  std::vector<LayerView> critic;          // of an actor's critic, if any: "critic.…"
  double limit = 0;                       // largest torque, N·m, or largest number of an action
  ExportedTask task;

  const ActionRuleFacts& rule() const { return policy->parts().facts(); }
  /// The torques that the policy chooses from; empty: any within the limit.
  const std::vector<double>& torques() const { return policy->parts().torques; }
  bool is_discrete() const { return rule().chooses_torque(); }
  /// Whether the critic takes the action, in units of its limit, after the observation.
  bool critic_takes_action() const { return !critic.empty() && critic.front().in() > obs_size(); }
  int obs_size() const { return policy->obs_size(); }
  int action_size() const { return policy->action_size(); }
  bool is_foreign() const { return loaded->is_foreign(); }
  /// Size of a state; for a foreign task, the observation stands for the state.
  size_t state_size() const { return is_foreign() ? task.observation.size() : task.state.size(); }
  /// The layers whose outputs choose the action: the features and, in a dueling network, the
  /// advantages.
  std::vector<LayerView> ActingLayers() const;
};

/// The largest magnitude in `values`; 0 if it is empty.
double LargestSize(std::span<const double> values);

/// Views a policy, which must outlive the result. Throws BadInput, with the path, if the policy was
/// not learned, or if its torques exceed float.
ExportedPolicy ViewForExport(const LoadedPolicy& loaded);

}  // namespace upswing::deploy
