#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "agents/controllers.h"
#include "agents/loaded_policy.h"

/// Loading of policies by name: a policy file, a run folder, a shipped policy or a controller.
namespace upswing {

/// A policy as named on a command line.
struct PolicyArguments {
  std::string name;  // controller (agents/controllers.h), file, run folder or shipped policy
  std::vector<FlagValue> flags;  // settings of the controller
  // The controller's design plant: changes such as mass2=1.2, and at most one plant file.
  std::vector<std::string> made_for;
  std::optional<Plant> plant = {};  // design plant before made_for; nothing: the task's
  double control_period = 0;        // s; 0: the policy's own, or that of the size of the plant

  bool has_settings() const { return !flags.empty() || !made_for.empty(); }
  bool empty() const { return name.empty() && !has_settings(); }
};

/// The file of a policy that comes with the program, such as `sac`; empty if there is none, or if
/// a file or folder here has this name.
std::filesystem::path ShippedPolicy(const std::filesystem::path& name);
/// Names of the policies that come with the program, sorted.
std::vector<std::string> ShippedPolicies();

/// Makes the controller with this name, or loads the policy as LoadPolicy does. Also throws
/// BadInput if the name could mean a controller or a file, or if there are controller settings for
/// a policy that is not a controller.
LoadedPolicy GetPolicy(const PolicyArguments& a);

/// Makes the controller `name`, which messages call `title`, without reading a file. The settings
/// and the control period of `given` hold for plants of any size; others follow the plant. Throws
/// as MakeController does.
LoadedPolicy DesignController(const std::string& name, const ControllerConfig& config,
                              const std::string& title, const PolicyArguments& given = {});

/// A controller that cannot be designed for its plant, and the reason in a line.
struct Undesigned {
  std::string name, reason;
};

/// Gets policies of the double pendulum by these names, each a PolicyArguments::name. Each
/// controller gets those settings in `controllers` that it has. Controllers that cannot be designed
/// are left out and added to `undesigned`; without this list, they throw. Throws BadInput if none
/// of the policies has a given setting.
std::vector<LoadedPolicy> GetPolicies(const std::vector<std::string>& names,
                                      const PolicyArguments& controllers,
                                      std::vector<Undesigned>* undesigned = nullptr);

/// Loads a policy file, the best policy of a run folder, or a shipped policy. Throws as
/// ReadPolicy does.
LoadedPolicy LoadPolicy(const std::filesystem::path& path);

/// Short title of a policy for pictures: the folder of a run, or a file without its extension. A
/// long title keeps only its end.
std::string ShortTitle(const LoadedPolicy& loaded);

}  // namespace upswing
