#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "setup/loaded_policy.h"

/// Policies by what a command line calls them: a controller's name, a file or a run folder.
namespace upswing {

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

/// Loads a policy file, or the best policy of a run folder. Throws as PolicyIn, and BadInput if its
/// model is none.
LoadedPolicy LoadPolicy(const std::filesystem::path& path);

/// The same of a policy file that has been read.
LoadedPolicy ReadPolicy(const Tensors& file);

/// A short title for a picture: of a run the folder's name, of another file its stem.
std::string TitleOf(const LoadedPolicy& loaded);
/// Those of several policies, with as many folders before them as tell them apart; of long ones the
/// end.
std::vector<std::string> TitlesOf(const std::vector<LoadedPolicy>& policies);

}  // namespace upswing
