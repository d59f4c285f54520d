// Settings for Python, with the names, ranges and messages of the program.
#include <nanobind/stl/pair.h>
#include <nanobind/stl/vector.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <string_view>

#include "agents/config.h"
#include "base/text.h"
#include "python/src/bindings.h"
#include "runs/config_files.h"

namespace upswing {
namespace {

namespace nb = nanobind;

nb::object ValueOf(const Option& option) {
  return std::visit([](const auto* target) -> nb::object { return nb::cast(*target); },
                    option.target);
}

std::vector<std::string> NamesOfAgents() {
  std::vector<std::string> names;
  for (const auto& [name, about] : NamedAgents()) names.push_back(name);
  return names;
}

/// One setting as a dictionary.
nb::dict Describe(const Option& option) {
  constexpr std::array kTypes{"bool", "int", "float", "str", "list[int]"};  // in Target's order
  nb::dict d;
  d["name"] = option.name;
  d["section"] = option.section;
  d["type"] = kTypes.at(option.target.index());
  d["default"] = ValueOf(option);
  const bool integer = option.target.index() == 1;
  const bool number = integer || option.target.index() == 2;
  const auto end = [&](double value) -> nb::object {
    if (!number || !std::isfinite(value)) return nb::none();
    return integer ? nb::cast(static_cast<int64_t>(value)) : nb::cast(value);
  };
  d["low"] = end(option.lowest());
  d["high"] = end(option.range.high);
  d["step"] = option.step > 0 ? nb::cast(option.step) : nb::none();
  d["choices"] = option.name == "agent" ? NamesOfAgents() : option.choices;
  d["unit"] = option.unit;
  d["help"] = option.help;
  d["environment"] = IsEnvironmentSetting(option);
  return d;
}

nb::list Describe(const Options& options) {
  nb::list list;
  for (const Option& option : options.all()) list.append(Describe(option));
  return list;
}

/// Aliases, each a name for several settings.
nb::list Aliases(const Options& options) {
  nb::list list;
  for (const auto& alias : options.aliases()) {
    nb::dict d;
    d["name"] = alias.name;
    d["section"] = alias.section;
    d["members"] = alias.members;
    d["help"] = alias.help;
    list.append(d);
  }
  return list;
}

/// Settings and aliases of an agent's training.
nb::tuple SettingsOfTraining(const std::string& agent) {
  Config config = BuildConfig("", {{"agent", agent, "agent"}});
  const Options options = OptionsOf(config);
  return nb::make_tuple(Describe(options), Aliases(options));
}

/// Settings and aliases of a trial.
nb::tuple SettingsOfTrial() {
  TrialSurroundings surroundings;
  const Options options = OptionsOf(surroundings);
  return nb::make_tuple(Describe(options), Aliases(options));
}

}  // namespace

bool IsEnvironmentSetting(const Option& option) {
  constexpr std::array<std::string_view, 4> kMore{"agent", "envs", "threads", "start_noise"};
  Config scratch;
  Options of_environment;
  scratch.DescribeEnvironment(of_environment);
  return (of_environment.Get(option.name) != nullptr && option.name != "eval_physics") ||
         std::ranges::find(kMore, option.name) != kMore.end();
}

nb::dict PlantDict(const Plant& plant) {
  nb::dict d;
  for (const auto& [name, value] : PlantValues(plant)) d[name.c_str()] = value;
  return d;
}

std::vector<FlagValue> FlagsOf(const SettingTexts& settings) {
  const Options every = EverySetting();
  const auto is_alias = [&](const auto& setting) {
    return std::ranges::any_of(every.aliases(),
                               [&](const auto& alias) { return alias.name == setting.first; });
  };
  std::vector<FlagValue> flags;
  for (const bool aliases : {true, false}) {
    for (const auto& setting : settings) {
      if (is_alias(setting) != aliases) continue;
      flags.push_back({setting.first, setting.second, Printable(setting.first)});
    }
  }
  return flags;
}

void BindSettings(nb::module_& m) {
  m.def("training_settings", &SettingsOfTraining, nb::arg("agent"));
  m.def("trial_settings", &SettingsOfTrial);
  m.def("agents", &NamedAgents);
}

}  // namespace upswing
