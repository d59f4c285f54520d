#pragma once

#include <functional>
#include <memory>
#include <string>

#include "agents/config.h"
#include "base/policy.h"
#include "base/tensors.h"
#include "pendulum/plant.h"

namespace upswing {

/// A policy and what it needs to be tried out.
struct LoadedPolicy {
  std::string name;  // for messages
  std::string path;  // its file; empty for a controller
  std::shared_ptr<const Policy> policy;
  std::string task;  // kDoublePendulum, or that of an environment of Gymnasium
  Plant plant;       // of the training or of the design, for the double pendulum
  // Designs the controller for another plant; empty for a learned policy. Throws BadInput if no
  // such controller exists.
  std::function<std::shared_ptr<const Policy>(const Plant&)> design_for = {};
  std::shared_ptr<const Policy> swing_up = {};  // what the controller hybrid swings up with

  /// Whether it is for an environment that only Python makes and steps.
  bool is_foreign() const { return IsForeign(task); }
  /// Number of past steps in its observations.
  int memory() const;
  /// Whether its observations contain an estimate of the plant.
  bool identifies() const;
  /// Whether its observations contain the pose to reach.
  bool seeks_any_pose() const;
  /// Origin: "training", or "design" for a controller.
  const char* origin() const { return path.empty() ? "design" : "training"; }
};

/// The policy in a file. Throws BadInput also for a task that this program lacks: another control
/// period, other observations, or a model that a 0.5.0 training had from an MJCF file.
LoadedPolicy ReadPolicy(const Tensors& file);

/// Throws BadInput unless the policy is for the double pendulum.
void ExpectPendulum(const LoadedPolicy& loaded);

/// Metadata of a policy file on its agent and task.
PolicyInfo InfoOf(const Config& config);

}  // namespace upswing
