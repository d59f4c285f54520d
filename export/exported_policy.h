#pragma once

#include <span>
#include <string>
#include <vector>

#include "core/env.h"
#include "nn/network_policy.h"
#include "setup/loaded_policy.h"

/// A learned policy for those that write it in another form (ONNX, C): its layers, and what goes in
/// and comes out, in words.
namespace upswing {

/// ε of layer normalisation, as LayerNormForward has it.
inline constexpr float kLayerNormEpsilon = 1e-5F;

/// A number that goes into a policy, or that an observation is made of.
struct NamedInput {
  std::string name;     // such as "w1"
  std::string meaning;  // such as "velocity of q1 over 10 rad/s"
};

/// What exports say of a task, and the file of export/c that observes it.
struct ExportedTask {
  std::string name, file;
  std::string goal;                     // what a policy does
  std::string motor;                    // where its torque acts
  std::vector<NamedInput> state;        // (S)
  std::vector<NamedInput> observation;  // (D)
};

/// The double pendulum with a motor at this joint; observations remember `memory` steps.
ExportedTask PendulumTask(double actuated_joint, int memory);

struct ExportedPolicy {
  const LoadedPolicy* loaded = nullptr;
  EnvSpec spec;                           // of its task
  const NetworkPolicy* policy = nullptr;  // of `loaded`
  std::vector<LayerView> layers;          // of its network; see Network::Views
  std::vector<LayerView> critic;          // of an actor's critic, if it has one: "critic.…"
  double limit = 0;                       // no torque is beyond it, N·m
  ExportedTask task;

  ActionRule rule() const { return policy->parts().rule; }
  /// The torques that it chooses from; empty: any within the limit.
  const std::vector<double>& torques() const { return policy->parts().torques; }
  bool is_discrete() const { return !torques().empty(); }
  /// Whether the critic takes the action's share of its limit behind the observation.
  bool critic_takes_action() const { return !critic.empty() && critic.front().in() > obs_size(); }
  int obs_size() const { return policy->obs_size(); }
  /// The layers whose outputs choose the action: features, and of a dueling network the advantages.
  std::vector<LayerView> ActingLayers() const;
};

/// The largest size of some numbers; 0 of none.
double LargestSize(std::span<const double> values);

/// Views a policy, which has to outlive the result. Throws BadInput, with the path, if it was not
/// learned, or if its torques are beyond float.
ExportedPolicy ViewForExport(const LoadedPolicy& loaded);

}  // namespace upswing
