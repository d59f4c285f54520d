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
  std::string name;  // for people
  std::string path;  // of its file; empty: a controller, which has none
  std::shared_ptr<const Policy> policy;
  std::string task;  // see TaskNames
  // Of the double pendulum:
  Plant plant;       // what it was made for
  std::string mjcf;  // empty: the built-in model
  // Of a controller: the same, made for another plant; throws BadInput if there is none for it.
  std::function<std::shared_ptr<const Policy>(const Plant&)> remade = {};

  /// How many past steps its observations remember.
  int memory() const;
  /// Whether they hold an estimate of the plant.
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
