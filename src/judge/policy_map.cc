#include "judge/policy_map.h"

#include <fmt/format.h>

#include "agents/config.h"
#include "base/error.h"
#include "base/format.h"
#include "base/text.h"
#include "os/file.h"

namespace upswing {
namespace {

constexpr int64_t kMostEpisodes = 10000000;

/// Conditions of a policy's training, or of a controller's design.
struct DesignConditions {
  MapPoint point;               // plant and disturbance; starts hanging
  Randomization randomization;  // around `point`
  bool known = false;           // whether the file has more than the plant
  std::string word;             // "training" or "design"
};

DesignConditions DesignOf(const LoadedPolicy& loaded) {
  DesignConditions design;
  design.point.plant = loaded.plant;
  design.point.control_period = loaded.control_period();
  design.word = loaded.origin();
  if (loaded.path.empty()) {
    design.known = true;  // designed without noise, delay and random plants
    return design;
  }
  const std::string& settings = loaded.policy->info().config;
  if (settings.empty()) return design;
  try {
    const Config config = ReadRecord(settings, "config").config;
    design.point.disturbance = config.disturbance;
    design.randomization = config.randomization;
    design.known = true;
  } catch (const Error&) {  // NOLINT(bugprone-empty-catch): values that this version refuses
  }
  return design;
}

/// Values on no axis that differ from the training, such as `mass1 1.2 kg (training: 1), …`.
std::string ChangesOf(const MapConfig& config, const DesignConditions& design) {
  std::vector<std::string> texts;
  for (const auto& [option, before] :
       Differences(OptionsOf(config.point), OptionsOf(design.point))) {
    if (config.x.Sets(option.name) || config.y.Sets(option.name)) continue;
    texts.push_back(fmt::format("{} {:.4g} {}", option.name, option.number(), option.unit));
    if (option.section == "start") continue;
    texts.back() += fmt::format(" ({}: {:.4g})", design.word, before->number());
  }
  if (config.env.assumed_plant) texts.emplace_back("the plant unknown to the policy");
  return Join(texts, ", ");
}

/// Label of the training's point, if it is on the map.
std::string DotOf(const MapConfig& config, const DesignConditions& design, bool changed) {
  const MapAxis &x = config.x, &y = config.y;
  if (x.start && y.start && !changed) return "hanging";
  if (design.randomization.any()) return "middle of the training's range";
  if (!changed && !config.start_given && design.known) {
    return Concat("as in ", design.word);
  }
  const auto piece = [&](const MapAxis& axis) {
    return Concat(axis.name, axis.start ? " hanging" : Concat(" as in ", design.word));
  };
  return Concat(piece(x), ", ", piece(y));
}

/// Throws BadInput if both axes set the same quantity.
void CheckDifferent(const MapAxis& x, const MapAxis& y) {
  for (const std::string& setting : x.settings) {
    if (!y.Sets(setting)) continue;
    throw BadInput(Concat("--x and --y: expected two different quantities, got ", x.name, " and ",
                          y.name, ", which both set ", setting));
  }
}

MapConfig ConfigOf(const MapArguments& a, const LoadedPolicy& loaded,
                   const DesignConditions& design) {
  MapConfig config;
  TrialArguments trial = a.trial;
  // These change config.point, not the environments.
  trial.plant_flags.clear();
  config.env = TrialEnvironments(trial, &loaded);
  config.point.plant = config.env.plants.front();
  config.point.disturbance = config.env.disturbance(0);
  config.point.control_period = config.env.control_period;
  config.x = ParseMapAxis(a.x, design.point, "--x");
  config.y = ParseMapAxis(a.y, design.point, "--y");
  CheckDifferent(config.x, config.y);
  const Options options = OptionsOf(config.point);
  for (MapAxis* axis : {&config.x, &config.y}) {
    const bool in_plant = options.Get(axis->settings.front())->section != "disturbance";
    if (!in_plant && !design.known) axis->at_training.reset();
  }
  const auto expect_no_axis = [&](const Option& option, const std::string& where) {
    for (const MapAxis* axis : {&config.x, &config.y}) {
      if (!axis->Sets(option.name)) continue;
      throw BadInput(Concat(where, ": expected a quantity that is on no axis; the axis ",
                            axis->name, " sets it"));
    }
  };
  SetFlags(options, a.trial.plant_flags);
  for (const FlagValue& flag : a.trial.plant_flags) {
    const std::string where = FlagOf(flag.name);
    for (const Option* option : options.Find(flag.name, where)) expect_no_axis(*option, where);
  }
  for (const Option* option : ApplyChanges(options, InUnitsOfMap(a.set, "--set"))) {
    config.start_given |= option->section == "start";
    expect_no_axis(*option, Concat("--set ", option->name));
  }
  config.start_given |= config.x.start || config.y.start;
  // Without noise, all episodes from one start are the same.
  const int usual = config.start_given ? 1 : 10;
  config.episodes = a.episodes > 0 ? static_cast<int>(a.episodes) : usual;
  if (config.cells() * config.episodes > kMostEpisodes) {
    throw BadInput(Concat("map: expected at most ", FormatCount(kMostEpisodes), " episodes, got ",
                          FormatCount(config.cells()), " cells × ", config.episodes, " episodes"));
  }
  return config;
}

}  // namespace

void MapArguments::Describe(Options& o) {
  o.Add(&episodes, "episodes", {1, 100000}, "", "number of episodes per cell").usual =
      "10; 1 if the start is given";
}

TrialArguments MapArguments::PlantTrial() const {
  TrialArguments of_plant = trial;
  Plant plant;
  const Options options = OptionsOf(plant);
  for (const std::string& change : set) {
    const std::string_view name = std::string_view(change).substr(0, change.find('='));
    const bool is_alias = std::ranges::find(options.aliases(), name, &Options::AliasEntry::name) !=
                          options.aliases().end();
    if (is_alias || options.Get(name) != nullptr) of_plant.set.push_back(change);
  }
  return of_plant;
}

MapResult PlanMap(const MapArguments& a, const LoadedPolicy& loaded) {
  ExpectPendulum(loaded);
  MapResult map;
  const DesignConditions design = DesignOf(loaded);
  map.config = ConfigOf(a, loaded, design);
  map.changes = ChangesOf(map.config, design);
  map.dot = DotOf(map.config, design, !map.changes.empty());
  map.policy = loaded.name;
  map.title = ShortTitle(loaded);
  return map;
}

}  // namespace upswing
