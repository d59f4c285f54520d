#pragma once

#include <filesystem>
#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "core/policy.h"
#include "core/tensors.h"
#include "setup/config.h"
#include "sim/double_pendulum.h"

namespace upswing {

/// A policy and what it needs to be tried out.
struct LoadedPolicy {
  std::string name;            // for people
  std::filesystem::path path;  // of its file; empty: a controller, which has none
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

/// A policy as a command line names it.
struct PolicyArguments {
  std::string name;              // of a controller (setup/controllers.h), a file or a run folder
  std::vector<FlagValue> flags;  // settings of the controller
  std::vector<std::string> made_for;  // and its plant, such as mass2=1.2

  bool has_settings() const { return !flags.empty() || !made_for.empty(); }
  bool empty() const { return name.empty() && !has_settings(); }
};

/// Makes the controller of that name, or loads the policy from the path. Throws BadInput, too, if
/// the name can mean both, or if settings of a controller are given for what is none.
LoadedPolicy GetPolicy(const PolicyArguments& a);

/// The policies of these names, each a PolicyArguments::name. Settings of controllers go to those
/// among them that have such; throws BadInput if none has.
std::vector<LoadedPolicy> GetPolicies(const std::vector<std::string>& names,
                                      const PolicyArguments& controllers);

/// Loads a policy file, or the best policy of a run folder. Throws BadInput, too, where the file
/// says of its task what this program cannot do: another control period, other observations.
LoadedPolicy LoadPolicy(const std::filesystem::path& path);

/// A short title for a picture: of a run the folder's name, of another file its stem.
std::string TitleOf(const LoadedPolicy& loaded);
/// Those of several policies, with as many folders before them as tell them apart; of long ones the
/// end.
std::vector<std::string> TitlesOf(const std::vector<LoadedPolicy>& policies);

/// The same of a policy file that has been read.
LoadedPolicy ReadPolicy(const Tensors& file);

/// What a policy file says of the agent and the task that it was trained on.
PolicyInfo InfoOf(const Config& config);

}  // namespace upswing
