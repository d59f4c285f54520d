#include "runs/find_policy.h"

#include <algorithm>
#include <set>

#include "base/error.h"
#include "base/format.h"
#include "base/text.h"
#include "os/command.h"
#include "runs/plant_file.h"
#include "runs/run_folder.h"
#include "runs/tensor_file.h"

namespace upswing {
namespace {

namespace fs = std::filesystem;

/// Adds runs with a policy in a folder, and in its folders down to `depth`, to `runs` until it has
/// enough for a message.
void FindRuns(const fs::path& folder, int depth, std::vector<std::string>& runs) {
  constexpr size_t kEnough = 3;
  std::error_code none;
  std::set<fs::path> folders;  // sorted by name
  for (const auto& entry : fs::directory_iterator(folder, none)) {
    if (entry.is_directory(none)) folders.insert(entry.path());
  }
  for (const fs::path& each : folders) {
    if (runs.size() == kEnough) return;
    if (fs::exists(each / RunFolder::kPolicy, none)) {
      runs.push_back(Printable(each.string()));
    } else if (depth > 1) {
      FindRuns(each, depth - 1, runs);
    }
  }
}

/// Why a folder without a policy is none.
std::string WhyNoPolicy(const fs::path& folder) {
  if (fs::exists(folder / RunFolder::kConfig)) return "one without; the first evaluation writes it";
  std::vector<std::string> runs;
  FindRuns(folder, 2, runs);  // a study's runs are in STUDY/VARIANT/seed1
  if (!runs.empty()) return Concat("a folder of runs, such as ", Join(runs, ", "));
  return "another folder, which comes before a policy of that name";
}

/// Loads a policy as LoadPolicy does. Messages offer controllers if the caller `takes_controllers`.
LoadedPolicy LoadNamed(const fs::path& path, bool takes_controllers) {
  if (const fs::path shipped = ShippedPolicy(path); !shipped.empty()) {
    LoadedPolicy loaded = ReadPolicy(LoadTensors(shipped, kMostPolicyBytes));
    loaded.name = path.string();
    return loaded;
  }
  fs::path file = path;
  if (fs::is_directory(path)) {
    file = path / RunFolder::kPolicy;
    if (!fs::exists(file)) {
      throw BadInput(Concat(path.string(), ": expected a run with a policy.safetensors, got ",
                            WhyNoPolicy(path)));
    }
  }
  if (!fs::exists(file)) {
    if (IsController(path.string())) {
      throw BadInput(Concat(path.string(), ": expected a policy.safetensors, a run folder or a ",
                            "shipped policy, got a controller"));
    }
    std::vector<std::string> names = ShippedPolicies();
    if (takes_controllers) std::ranges::copy(ControllerNames(), std::back_inserter(names));
    throw BadInput(Concat(
        file.string(), ": no such file; expected a policy.safetensors, a run ", "folder",
        takes_controllers ? ", a shipped policy or a controller (" : " or a shipped policy (",
        Join(names, ", "), ")", DidYouMean(path.string(), names)));
  }
  return ReadPolicy(LoadTensors(file, kMostPolicyBytes));
}

/// The controller that a setting belongs to.
std::string SectionOf(const FlagValue& flag) {
  ControllerConfig config;
  return OptionsOf(config).Find(flag.name, FlagOf(flag.name)).front()->section;
}

/// Loads the policy for --swing-up. Throws BadInput that names the flag.
LoadedPolicy SwingUpNamed(const std::string& name) {
  try {
    LoadedPolicy loaded = LoadPolicy(name);
    ExpectPendulum(loaded);
    return loaded;
  } catch (const Error& error) {
    throw Error(error.exit_code(), Concat("--swing-up: ", error.what()));
  }
}

/// Applies --made-for: a plant file, if there is one, then the changes. Returns the plant
/// before the changes. Throws BadInput.
PlantFile ChangeDesignPlant(const PolicyArguments& a, Plant& plant) {
  std::vector<std::string> changes, files;
  for (const std::string& text : a.made_for) {
    (text.find('=') == std::string::npos ? files : changes).push_back(text);
  }
  if (files.size() > 1) {
    throw BadInput(
        Concat("--made-for: expected at most one plant file, got ", Join(files, " and ")));
  }
  PlantFile file;
  if (a.plant) file.plant = plant = *a.plant;
  if (!files.empty()) {
    file = ReadPlantFile(files.front(), "--made-for", "NAME=VALUE, ");
    file.name = files.front();
    plant = file.plant;
  }
  ApplyChanges(OptionsOf(plant), changes, "--made-for");
  return file;
}

/// A controller before its design.
struct ControllerPlan {
  ControllerConfig config;
  std::string title;
};

/// The plan of the controller that the arguments name. Throws BadInput for wrong arguments.
ControllerPlan PlanNamed(const PolicyArguments& a) {
  ControllerConfig asked;
  SetFlags(OptionsOf(asked), a.flags);
  DesignPlant plant;
  std::shared_ptr<const Policy> swing_up;
  if (!asked.swing_up.empty()) {
    const LoadedPolicy loaded = SwingUpNamed(asked.swing_up);
    plant = {loaded.plant, loaded.control_period()};
    swing_up = loaded.policy;
  }
  const PlantFile made_for = ChangeDesignPlant(a, plant);
  if (a.control_period > 0) {
    plant.control_period = a.control_period;
  } else if (!swing_up) {
    plant.control_period = kControlPeriod * TaskScaleOf(plant).time;
  }
  ControllerConfig config = ControllerConfig::For(plant);
  SetFlags(OptionsOf(config), a.flags);
  config.swing_up_policy = swing_up;
  return {config, TitleOf(a.name, config, made_for.name, made_for.plant)};
}

LoadedPolicy DesignNamed(const PolicyArguments& a) {
  const ControllerPlan plan = PlanNamed(a);
  return DesignController(a.name, plan.config, plan.title, a);
}

/// The policy that the arguments name. A controller that cannot be designed is added to
/// `undesigned`, if there is such a list.
std::optional<LoadedPolicy> GetOrExplain(const PolicyArguments& a,
                                         std::vector<Undesigned>* undesigned) {
  if (undesigned == nullptr || !IsController(a.name) || fs::exists(a.name)) return GetPolicy(a);
  const ControllerPlan plan = PlanNamed(a);
  try {
    return DesignController(a.name, plan.config, plan.title, a);
  } catch (const Error& error) {
    undesigned->push_back({a.name, error.what()});
    return std::nullopt;
  }
}

/// Throws BadInput if a setting belongs to no controller in `names`.
void CheckSettings(const PolicyArguments& settings, const std::vector<std::string>& names) {
  const std::string got = names.empty() ? "none" : Join(names, ", ");
  if (settings.has_settings() && std::ranges::none_of(names, IsController)) {
    const std::string flag =
        settings.flags.empty() ? "--made-for" : FlagOf(settings.flags.front().name);
    throw BadInput(Concat(flag, ": expected a controller (", Join(ControllerNames(), ", "),
                          ") with it, got ", got));
  }
  for (const FlagValue& flag : settings.flags) {
    const std::string section = SectionOf(flag);
    const auto has = [&](const std::string& name) {
      return IsController(name) && HasSection(name, section);
    };
    if (std::ranges::any_of(names, has)) continue;
    throw BadInput(
        Concat(FlagOf(flag.name), ": expected the controller ", section, " with it, got ", got));
  }
}

}  // namespace

fs::path ShippedPolicy(const fs::path& name) {
  if (name.empty() || name.has_parent_path() || fs::exists(name)) return {};
  return PageFile(fs::path("agents") / Concat(name.string(), ".safetensors"));
}

std::vector<std::string> ShippedPolicies() {
  std::vector<std::string> names;
  std::error_code none;
  for (const auto& entry : fs::directory_iterator(PageFile("agents"), none)) {
    const std::string name = entry.path().stem().string();
    const bool is_stage = name.find("-at-") != std::string::npos;  // of the page's training
    if (entry.path().extension() == ".safetensors" && !is_stage) names.push_back(name);
  }
  std::ranges::sort(names);
  return names;
}

std::vector<LoadedPolicy> GetPolicies(const std::vector<std::string>& names,
                                      const PolicyArguments& controllers,
                                      std::vector<Undesigned>* undesigned) {
  CheckSettings(controllers, names);
  std::vector<LoadedPolicy> policies;
  std::set<fs::path> seen;  // files, and names of controllers
  for (const std::string& name : names) {
    PolicyArguments one{name, {}, {}};
    one.control_period = controllers.control_period;
    if (IsController(name)) {
      one.made_for = controllers.made_for;
      std::ranges::copy_if(controllers.flags, std::back_inserter(one.flags),
                           [&](const auto& flag) { return HasSection(name, SectionOf(flag)); });
    }
    std::optional<LoadedPolicy> loaded = GetOrExplain(one, undesigned);
    std::error_code none;
    const auto file = fs::canonical(loaded ? loaded->path : "", none);
    const fs::path key = none ? fs::path(name) : file;
    if (!seen.insert(key).second) {
      throw BadInput(Concat(Printable(name), ": expected each policy once, got it twice"));
    }
    if (!loaded) continue;
    ExpectPendulum(*loaded);
    policies.push_back(*std::move(loaded));
  }
  return policies;
}

LoadedPolicy GetPolicy(const PolicyArguments& a) {
  CheckSettings(a, a.name.empty() ? std::vector<std::string>() : std::vector{a.name});
  const bool is_controller = IsController(a.name), is_path = fs::exists(a.name);
  if (is_controller && is_path) {
    throw BadInput(Concat(a.name, ": expected a controller or a file, got the name of both; ./",
                          a.name, " means the file; rename the file to use the controller"));
  }
  if (is_controller) return DesignNamed(a);
  LoadedPolicy loaded = LoadNamed(a.name, true);
  if (a.control_period == 0 || a.control_period == loaded.control_period()) return loaded;
  throw BadInput(Concat("--control-period: expected ", FormatNumber(loaded.control_period()),
                        " s, the control period of ", Printable(loaded.name),
                        " on its own plant, got ", FormatNumber(a.control_period)));
}

LoadedPolicy DesignController(const std::string& name, const ControllerConfig& config,
                              const std::string& title, const PolicyArguments& given) {
  const auto design_for = [name, config, given](const Plant& plant) {
    ControllerConfig other = config;
    const Scale ratio = CarryOver(config.plant, plant);
    if (ratio != Scale()) {
      other = config.In(ratio);
      SetFlags(OptionsOf(other), given.flags);
      if (given.control_period > 0) other.plant.control_period = given.control_period;
    }
    static_cast<Plant&>(other.plant) = plant;
    return MakeController(name, other);
  };
  return {.name = title,
          .path = "",
          .policy = MakeController(name, config),
          .task = kDoublePendulum,
          .plant = config.plant,
          .design_for = design_for,
          .swing_up = config.swing_up_policy};
}

LoadedPolicy LoadPolicy(const fs::path& path) { return LoadNamed(path, false); }

std::string ShortTitle(const LoadedPolicy& loaded) {
  fs::path title = loaded.name;
  if (title.filename() == RunFolder::kPolicy && title.has_parent_path()) {
    title = title.parent_path();
  } else if (title.extension() == ".safetensors") {
    title.replace_extension();
  }
  constexpr size_t kLongest = 30;  // bytes
  return Shortened(title.string(), kLongest);
}

}  // namespace upswing
