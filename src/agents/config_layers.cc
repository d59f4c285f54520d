// The layers of a training's settings: defaults, named agent, configuration file, flags.
#include <algorithm>
#include <cmath>
#include <map>

#include "agents/config.h"
#include "agents/config_checks.h"
#include "agents/named_agents.h"
#include "agents/toml_settings.h"
#include "base/error.h"
#include "base/text.h"
#include "pendulum/control_period.h"
#include "pendulum/scale.h"

namespace upswing {
namespace {

const NamedAgent& FindAgent(const std::string& name, const std::string& where) {
  const auto agents = EmbeddedAgents();
  const auto found = std::ranges::find_if(agents, [&](const auto& a) { return a.name == name; });
  if (found != agents.end()) return *found;
  const std::vector<std::string> names = NamesOf(agents);
  throw BadInput(Concat(where, ": expected an agent, one of ", Join(names, ", "), ", got \"", name,
                        "\"", DidYouMean(name, names)));
}

/// A setting that other settings depend on: its value in the last layer that sets it, and the
/// place of that value for messages.
struct EarlySetting {
  std::string value, where;
};

EarlySetting FindEarly(std::string_view section, std::string_view key, const toml::table& file,
                       const std::string& file_name, const std::vector<FlagValue>& flags) {
  EarlySetting setting;
  if (const toml::node* node = file[section][key].node()) {
    setting = {TextOf(*node).value_or(""), Concat(PlaceOf(*node, file_name), ": ", key)};
  }
  for (const auto& [name, text, where] : flags) {
    if (name == key) setting = {text, where.empty() ? FlagOf(name) : where};
  }
  return setting;
}

/// Throws BadInput that begins with `where` unless there is an algorithm of this name.
void CheckAlgorithm(const std::string& name, const std::string& where) {
  const std::vector<std::string>& names = AlgorithmNames();
  if (std::ranges::find(names, name) != names.end()) return;
  throw BadInput(Concat(where, ": expected one of ", Join(names, ", "), ", got \"", Printable(name),
                        "\"", DidYouMean(name, names)));
}

/// The algorithm of a parsed configuration. Throws BadInput.
std::string AlgorithmIn(const toml::table& table, const std::string& where) {
  const EarlySetting found = FindEarly("train", "algorithm", table, where, {});
  if (found.where.empty()) return AlgorithmNames().front();
  CheckAlgorithm(found.value, found.where);
  return found.value;
}

/// The named agent of a configuration, its settings and its algorithm.
struct ChosenAgent {
  std::string_view name;
  std::string place;  // for messages
  toml::table settings;
  std::string algorithm;
};

/// Chooses the named agent. Throws BadInput if it does not exist or has another algorithm than
/// requested.
ChosenAgent ChooseAgent(const toml::table& table, const std::string& where,
                        const std::vector<FlagValue>& flags) {
  EarlySetting setting = FindEarly("train", "agent", table, where, flags);
  if (setting.where.empty()) setting.value = Config().agent;
  const NamedAgent& agent = FindAgent(setting.value, setting.where);
  const std::string place = Concat("agent ", agent.name);
  toml::table settings = ParseToml(agent.toml, place);
  const std::string algorithm = AlgorithmIn(settings, place);
  const EarlySetting asked = FindEarly("train", "algorithm", table, where, flags);
  if (!asked.where.empty()) {
    CheckAlgorithm(asked.value, asked.where);
    if (asked.value != algorithm) {
      throw BadInput(Concat(asked.where, ": expected ", algorithm, ", the algorithm of agent ",
                            agent.name, ", got ", asked.value, "; choose another agent, such as ",
                            asked.value));
    }
  }
  return {agent.name, place, std::move(settings), algorithm};
}

/// Applies to a foreign task the network and the learning of a named agent, then the defaults.
void ApplyToForeign(const Options& options, const ChosenAgent& agent) {
  toml::table learner;
  for (const char* section : {"network", "agent"}) {
    if (const auto* settings = agent.settings[section].as_table())
      learner.insert(section, *settings);
  }
  ApplyTable(options, learner, agent.place, false);
  for (const NamedAgent& defaults : GymnasiumDefaults()) {
    if (defaults.name == agent.algorithm) ApplyToml(options, defaults.toml, "defaults");
  }
}

/// Completes settings by the environment of a foreign task: its discrete actions, and a learning
/// rate that decays until the last step unless `decay_given`. Throws BadInput.
void FitToForeign(const Options& options, bool decay_given, Config& config) {
  const ForeignTask task = ForeignTask::Parse(config.environment, "environment");
  if (!decay_given) options.Set("learning_rate_steps", options.Get("steps")->text(), "steps");
  const auto choices = static_cast<int64_t>(task.choices.size());
  if (config.learner().FitToActions(choices)) return;
  const std::vector<std::string> able =
      AlgorithmsThat([&](AgentConfig& settings) { return settings.FitToActions(choices); });
  throw BadInput(Concat("agent: expected an agent of ", Join(able, " or "),
                        ", because the actions of ", task.name, " are ",
                        choices > 0 ? "discrete" : "continuous", ", got ", config.agent,
                        ", an agent of ", config.algorithm));
}

/// A setting with a unit, and the power of the natural time in it.
struct TimedSetting {
  const char* name;
  int power;
};
constexpr TimedSetting kTimedSettings[] = {
    {"control_period", 1},           {"time_scale", 1},
    {"episode_seconds", 1},          {"random_start_drive", 1},
    {"random_start_velocity", -1},   {"delay", 1},
    {"randomize_delay", 1},          {"sensor_latency", 1},
    {"randomize_sensor_latency", 1}, {"velocity_window", 1},
    {"velocity_filter", 1},          {"late", 1},
};

/// Multiplies the settings with units that only the named agent gives by `ratio`: the natural units
/// of the plant over those of the agent's plant. `is_given` tells which settings the user has
/// given.
void FitToPlant(const Options& options, const Scale& ratio,
                const std::function<bool(const Option&)>& is_given) {
  if (ratio == Scale()) return;
  const auto multiply = [&](const char* name, double factor) {
    const Option& option = *options.Get(name);
    if (!is_given(option)) option.Set(FormatNumber(option.number() * factor), "plant");
  };
  for (const auto& [name, power] : kTimedSettings) {
    multiply(name, power > 0 ? ratio.time : ratio.velocity());
  }
  multiply("torque_scale", ratio.torque);
}

/// Keeps times of the agent that the user does not give, at another control period than `usual`
/// (s): the time that it looks ahead, 1 / (1 - gamma) control periods, and the length of SAC's
/// n-step returns. Returns of DQN keep their n: longer ones hold more random actions of its
/// exploration.
void FitToPeriod(const Options& options, double usual,
                 const std::function<bool(const Option&)>& is_given, const Config& config) {
  const double ratio = config.control_period / usual;
  if (ratio == 1) return;
  const Option& gamma = *options.Get("gamma");
  if (!is_given(gamma)) gamma.Set(FormatNumber(std::pow(gamma.number(), ratio)), "control_period");
  if (config.algorithm != "sac") return;
  const Option& n_step = *options.Get("n_step");
  if (is_given(n_step)) return;
  const auto steps = static_cast<double>(*std::get<int64_t*>(n_step.target));
  const double kept = std::clamp(std::round(steps / ratio), n_step.range.low, n_step.range.high);
  n_step.Set(FormatNumber(kept), "control_period");
}

/// Rounds the times that the user does not give to whole control periods.
void RoundToPeriods(const Options& options, const std::function<bool(const Option&)>& is_given,
                    const Config& config) {
  for (const char* name : {"episode_seconds", "delay", "randomize_delay"}) {
    const Option& option = *options.Get(name);
    if (is_given(option)) continue;
    const auto periods = static_cast<double>(PeriodsIn(option.number(), config.control_period));
    option.Set(FormatNumber(periods * config.control_period), "control_period");
  }
}

/// Turns `mirror` off for a reward that is not symmetric. Throws BadInput if the user set it, at
/// `place`.
void FitToReward(const Options& options, const std::string& place, const Config& config) {
  if (options.Get("mirror")->text() == "false") return;
  const std::string asymmetry = RewardAsymmetry(config.Environments());
  if (asymmetry.empty()) return;
  if (place.empty()) return options.Set("mirror", "false", "reward");
  throw BadInput(
      Concat(place, ": expected false with this reward, which is ", asymmetry, ", got true"));
}

/// Whether a flag sets this setting, as its name or an alias.
bool StandsFor(const std::string& flag, const std::string& setting) {
  if (flag == setting) return true;
  const Options every = EverySetting();
  return std::ranges::any_of(every.aliases(), [&](const auto& alias) {
    return alias.name == flag && std::ranges::find(alias.members, setting) != alias.members.end();
  });
}

}  // namespace

Options KnownOptions(Config& config) {
  Options options = OptionsOf(config);
  std::map<std::string, std::vector<std::string>> owners;
  for (const std::string& algorithm : AlgorithmNames()) {
    Config other(algorithm);
    const Options of_other = OptionsOf(other);
    for (const Option& option : of_other.all()) owners[option.name].push_back(algorithm);
  }
  for (const auto& [name, algorithms] : owners) {
    if (options.Get(name) != nullptr) continue;
    options.Explain(
        name, Concat("expected a setting of ", config.algorithm, ", the algorithm of agent ",
                     config.agent, ", got ", name, ", a setting of ", Join(algorithms, " and ")));
  }
  return options;
}

void SetFlags(const Options& options, const std::vector<FlagValue>& flags) {
  for (const auto& [name, value, place] : flags) {
    options.Set(name, value, place.empty() ? FlagOf(name) : place);
  }
}

void CheckNamingFlags(const std::vector<FlagValue>& flags, const std::string& where,
                      const std::function<void()>& check) {
  try {
    check();
  } catch (const Error& error) {
    const std::string what = error.what(), name = what.substr(0, what.find(':'));
    std::string place = Concat(where, where.empty() ? "" : ": ", name);
    for (const FlagValue& flag : flags) {
      if (flag.where.empty() && StandsFor(flag.name, name)) place = FlagOf(flag.name);
    }
    throw Error(error.exit_code(), Concat(place, what.substr(name.size())));
  }
}

Config ConfigIn(std::string_view text, const std::string& where) {
  const toml::table table = ParseToml(text, where);
  Config config(AlgorithmIn(table, where));
  ApplyTable(OptionsOf(config), table, where, false);
  return config;
}

RecordedConfig ReadRecord(const std::string& text, const std::string& where) {
  toml::table table = ParseToml(text, where);
  RecordedConfig record{Config(AlgorithmIn(table, where)), {}, {}};
  const Options options = OptionsOf(record.config);
  for (const Option& option : options.all()) {
    if (table[option.section][option.name]) continue;
    record.missing.push_back(Concat(option.section, ".", option.name));
  }
  record.unknown = TakeUnknown(options, table);
  ApplyTable(options, table, where, false);
  return record;
}

void ApplyToml(const Options& options, std::string_view text, const std::string& where) {
  ApplyTable(options, ParseToml(text, where), where, false);
}

Config ParseConfig(std::string_view text, const std::string& where,
                   const std::vector<FlagValue>& flags) {
  const toml::table table = ParseToml(text, where);
  const ChosenAgent agent = ChooseAgent(table, where, flags);
  const bool foreign = !FindEarly("task", "environment", table, where, flags).value.empty();
  Config config(agent.algorithm);
  config.agent = agent.name;
  const Options options = KnownOptions(config);  // its messages name the agent

  if (foreign) {
    ApplyToForeign(options, agent);
  } else {
    ApplyTable(options, agent.settings, agent.place, false);
  }
  const Plant designed = config.plant;
  const double designed_period = config.control_period;
  ApplyTable(options, table, where, false);
  SetFlags(options, flags);
  config.agent = agent.name;  // whatever its own file says
  CheckNamingFlags(flags, where, [&] {
    if (foreign) {
      const EarlySetting decay = FindEarly("agent", "learning_rate_steps", table, where, flags);
      FitToForeign(options, !decay.where.empty(), config);
    } else {
      const auto is_given = [&](const Option& option) {
        return !FindEarly(option.section, option.name, table, where, flags).where.empty();
      };
      const Scale ratio = CarryOver(designed, config.plant);
      FitToPlant(options, ratio, is_given);
      const double usual = designed_period * ratio.time;
      if (is_given(*options.Get("control_period"))) FitToPeriod(options, usual, is_given, config);
      if (config.control_period != designed_period) RoundToPeriods(options, is_given, config);
    }
    CheckSettings(config);
  });
  // Last, because only the reward of a checked configuration can be evaluated.
  FitToReward(options, FindEarly("agent", "mirror", table, where, flags).where, config);
  return config;
}

std::vector<std::pair<std::string, std::string>> NamedAgents() {
  std::vector<std::pair<std::string, std::string>> names;
  for (const NamedAgent& agent : EmbeddedAgents()) {
    // The file begins with a comment that describes the agent.
    std::vector<std::string> comment;
    for (const std::string_view line : Split(agent.toml, '\n')) {
      if (!line.starts_with('#')) break;
      comment.emplace_back(Trim(line.substr(1)));
    }
    names.emplace_back(agent.name, Join(comment, " "));
  }
  return names;
}

}  // namespace upswing
