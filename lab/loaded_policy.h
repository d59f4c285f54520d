#pragma once

#include <filesystem>
#include <memory>
#include <string>

#include "core/policy.h"
#include "core/tensors.h"
#include "lab/config.h"
#include "sim/double_pendulum.h"

namespace upswing {

/// A policy and what it needs to be tried out.
struct LoadedPolicy {
  std::filesystem::path path;
  std::shared_ptr<const Policy> policy;
  std::string task;  // see TaskNames
  // Of the double pendulum:
  Plant plant;       // at training
  std::string mjcf;  // empty: the built-in model

  /// How many past steps its observations remember.
  int memory() const;
};

/// Loads a policy file, or the best policy of a run folder. Throws BadInput, too, where the file
/// says of its task what this program cannot do: another control period, other observations.
LoadedPolicy LoadPolicy(const std::filesystem::path& path);

/// The same of a policy file that has been read.
LoadedPolicy ReadPolicy(const Tensors& file);

/// What a policy file says of the agent and the task that it was trained on.
PolicyInfo InfoOf(const Config& config);

}  // namespace upswing
