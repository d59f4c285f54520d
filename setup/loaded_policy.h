#pragma once

#include <functional>
#include <memory>
#include <string>

#include "core/policy.h"
#include "core/tensors.h"
#include "setup/config.h"
#include "sim/double_pendulum.h"

namespace upswing {

/// A policy and what it needs to be tried out.
struct LoadedPolicy {
  std::string name;  // for messages
  std::string path;  // its file; empty for a controller
  std::shared_ptr<const Policy> policy;
  std::string task;  // see TaskNames
  // Of the double pendulum:
  Plant plant;       // plant of the training or of the design
  std::string mjcf;  // empty: the built-in model
  // Designs the controller for another plant; empty for a learned policy. Throws BadInput if no
  // such controller exists.
  std::function<std::shared_ptr<const Policy>(const Plant&)> design_for = {};

  /// Number of past steps in its observations.
  int memory() const;
  /// Whether its observations contain an estimate of the plant.
  bool identifies() const;
  /// Where it is from: "training", or "design" of a controller.
  const char* origin() const { return path.empty() ? "design" : "training"; }
};

/// The policy in a file, whose model, if it is not the built-in one, is not checked. Throws
/// BadInput, too, where the file says of its task what this program cannot do: another control
/// period, other observations.
LoadedPolicy PolicyIn(const Tensors& file);

/// What a policy file says of the agent and the task that it was trained on.
PolicyInfo InfoOf(const Config& config);

}  // namespace upswing
