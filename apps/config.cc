#include "apps/config.h"

#include <toml++/toml.h>

#include <algorithm>
#include <nlohmann/json.hpp>

#include "apps/named_agents.h"
#include "core/error.h"
#include "core/file.h"
#include "core/text.h"
#include "sim/model.h"

namespace upswing {
namespace {

namespace fs = std::filesystem;
using nlohmann::json;

/// A TOML value as the text that Option::Set takes; nothing for a type that no setting has.
std::optional<std::string> TextOf(const toml::node& node) {
  if (const auto* value = node.as_boolean()) return value->get() ? "true" : "false";
  if (const auto* value = node.as_integer()) return std::to_string(value->get());
  if (const auto* value = node.as_floating_point()) return FormatNumber(value->get());
  if (const auto* value = node.as_string()) return value->get();
  const auto* array = node.as_array();
  if (array == nullptr) return std::nullopt;
  std::vector<std::string> items;
  for (const toml::node& item : *array) {
    if (!item.is_integer()) return std::nullopt;
    items.push_back(std::to_string(item.as_integer()->get()));
  }
  return Concat("[", Join(items, ", "), "]");
}

/// Sets one key of a TOML table.
void ApplyNode(const Options& options, const std::string& section, const std::string& key,
               const toml::node& node, const std::string& where) {
  const std::string place = Concat(where, ":", node.source().begin.line, ": ");
  for (const Option* option : options.Find(key, Concat(place, "[", section, "]"))) {
    if (option->section != section) {
      throw BadInput(
          Concat(place, key, ": expected in [", option->section, "], got in [", section, "]"));
    }
    const auto text = TextOf(node);
    const bool wants_text = std::holds_alternative<std::string*>(option->target);
    if (!text || node.is_string() != wants_text) {
      const std::string got = text ? Concat("\"", *text, "\"") : "another type";
      throw BadInput(Concat(place, key, ": expected ", option->expected(), ", got ", got));
    }
    option->Set(*text, place + key);
  }
}

toml::table ParseToml(std::string_view text, const std::string& where) {
  try {
    return toml::parse(text);
  } catch (const toml::parse_error& error) {
    throw BadInput(Concat(where, ":", error.source().begin.line, ": ", error.description()));
  }
}

/// Whether a text may stand in a file's metadata.
bool IsUtf8(const std::string& text) {
  try {
    (void)json(text).dump();
    return true;
  } catch (const json::exception&) {
    return false;
  }
}

const NamedAgent& FindAgent(const std::string& name, const std::string& where) {
  const auto agents = EmbeddedAgents();
  const auto found = std::ranges::find_if(agents, [&](const auto& a) { return a.name == name; });
  if (found != agents.end()) return *found;
  std::vector<std::string> names;
  for (const NamedAgent& agent : agents) names.emplace_back(agent.name);
  throw BadInput(Concat(where, ": no agent is called \"", name, "\"", DidYouMean(name, names),
                        "; there are ", Join(names, ", ")));
}

/// A text setting that other settings depend on: its value in the last layer that has it, and
/// where that is, for messages.
struct EarlySetting {
  std::string value, where;
};

EarlySetting FindEarly(std::string_view section, std::string_view key, const toml::table& file,
                       const std::string& file_name, const std::vector<FlagValue>& flags) {
  EarlySetting setting;
  if (const auto* node = file[section][key].as_string()) {
    setting = {node->get(), Concat(file_name, ":", node->source().begin.line, ": ", key)};
  }
  for (const auto& [name, text] : flags) {
    if (name == key) setting = {text, Concat("--", key)};
  }
  return setting;
}

}  // namespace

void Config::Describe(Options& o) {
  o.Section("train");
  o.Add(&agent, "agent", "d3qn", "named agent whose settings the others begin with");
  train.Describe(o);
  o.Section("task");
  o.Add(&episode_seconds, "episode_seconds", 4, {0.02, 1e6}, "s", "length of a training episode");
  o.Add(&random_start_share, "random_start_share", 0.5, kUnit, "",
        "share of the episodes that begin anywhere instead of hanging");
  o.Add(&random_start_velocity, "random_start_velocity", 5, {0, 50}, "rad/s",
        "largest velocity of those");
  o.Add(&memory, "memory", 0, {0, 100}, "steps",
        "past steps whose torque and change of velocities the agent sees too");
  o.AddChoice(&physics, "physics", PhysicsNames(),
              "engine to train in; closed-form is a faster twin of mujoco");
  o.AddChoice(&eval_physics, "eval_physics", PhysicsNames(), "engine of the evaluations");
  o.Section("plant");
  o.Add(&model, "model", "", "MJCF file to use instead of the built-in model");
  plant.Describe(o);
  disturbance.Describe(o);
  randomization.Describe(o);
  reward.Describe(o);
  dqn.Describe(o);
}

PendulumEnvConfig Config::Environments(ThreadPool& pool) const {
  PendulumEnvConfig env;
  env.pool = &pool;
  env.physics = ParsePhysics(physics, "--physics");
  env.plants = {plant};
  env.disturbances = {disturbance};
  env.randomization = randomization;
  env.num_envs = static_cast<int>(train.envs);
  env.episode_seconds = episode_seconds;
  env.memory = static_cast<int>(memory);
  env.start = {train.start_noise, random_start_share, random_start_velocity};
  env.weights = reward;
  env.seed = static_cast<uint64_t>(train.seed);
  env.stream = "training environment";
  env.mjcf = mjcf;
  return env;
}

void ApplyToml(const Options& options, std::string_view text, const std::string& where) {
  std::vector<std::string> sections;
  for (const Option& option : options.all()) sections.push_back(option.section);
  for (const auto& [section_key, node] : ParseToml(text, where)) {
    const std::string section(section_key.str());
    const std::string place = Concat(where, ":", node.source().begin.line, ": ");
    const auto* table = node.as_table();
    if (table == nullptr || std::ranges::find(sections, section) == sections.end()) {
      throw BadInput(
          Concat(place, "no section is called [", section, "]", DidYouMean(section, sections)));
    }
    for (const auto& [key, value] : *table) {
      ApplyNode(options, section, std::string(key.str()), value, where);
    }
  }
}

void SetFlags(const Options& options, const std::vector<FlagValue>& flags) {
  for (const auto& [name, value] : flags) {
    const std::string flag = options.Find(name, "").front()->flag();
    options.Set(name, value, flag);
  }
}

Config BuildConfig(const fs::path& file, const std::vector<FlagValue>& flags) {
  Config config;
  const Options options = OptionsOf(config);
  const std::string where = file.string();
  const std::string text = file.empty() ? "" : ReadTextFile(file);
  const toml::table table = ParseToml(text, where);

  // A model file brings its own plant, which other settings may change.
  const EarlySetting model = FindEarly("plant", "model", table, where, flags);
  std::string model_path = model.value;
  if (!model_path.empty() && model.where != "--model") {
    model_path = (file.parent_path() / model.value).string();  // counts from its file
  }
  if (!model_path.empty()) config.plant = ChangedPlant(config.plant, model_path, {}, config.mjcf);

  EarlySetting agent_setting = FindEarly("train", "agent", table, where, flags);
  if (agent_setting.where.empty()) agent_setting.value = config.agent;
  const NamedAgent& agent = FindAgent(agent_setting.value, agent_setting.where);
  ApplyToml(options, agent.toml, Concat("agent ", agent.name));
  if (!file.empty()) ApplyToml(options, text, where);
  SetFlags(options, flags);
  config.agent = agent.name;
  config.model = model_path;
  return config;
}

std::string ConfigToml(Config config, bool identity_only) {
  return OptionsOf(config).Toml(
      !identity_only, [&](const Option& option) { return !identity_only || option.identity; });
}

std::vector<std::pair<std::string, double>> PlantValues(Plant plant) {
  std::vector<std::pair<std::string, double>> values;
  const Options options = OptionsOf(plant);
  for (const Option& option : options.all()) {
    values.emplace_back(option.name, *std::get<double*>(option.target));
  }
  return values;
}

std::string PlantText(const Plant& plant) {
  std::vector<std::string> texts;
  for (const auto& [name, value] : PlantValues(plant)) {
    texts.push_back(Concat(name, " ", FormatNumber(value)));
  }
  return Join(texts, ", ");
}

std::vector<std::pair<std::string, std::string>> NamedAgents() {
  std::vector<std::pair<std::string, std::string>> names;
  for (const NamedAgent& agent : EmbeddedAgents()) {
    // The first line of the file is a comment that says what it is.
    const std::string_view first_line = agent.toml.substr(0, agent.toml.find('\n'));
    names.emplace_back(agent.name, Trim(first_line.substr(first_line.find_first_not_of("# "))));
  }
  return names;
}

LoadedPolicy LoadPolicy(const fs::path& path) {
  fs::path file = path;
  if (fs::is_directory(path)) {
    file = path / "policy.safetensors";
    if (fs::exists(path / "config.toml") && !fs::exists(file)) {
      throw BadInput(Concat(path.string(), ": this run has no policy yet: expected ",
                            "policy.safetensors, which its first evaluation writes"));
    }
  }
  if (!fs::exists(file)) {
    throw BadInput(
        Concat(file.string(), ": no such file; expected a policy.safetensors or a run ", "folder"));
  }
  LoadedPolicy loaded{file, Policy::Load(file), Plant(), 0, ""};
  const int remembered = static_cast<int>(loaded.policy.shape().inputs) - kObservationSize;
  if (remembered < 0 || remembered % kMemorySize != 0) {
    throw BadInput(Concat(file.string(), ": expected a policy of ", kObservationSize,
                          " observations and ", kMemorySize, " for each step of memory, got ",
                          loaded.policy.shape().inputs));
  }
  loaded.memory = remembered / kMemorySize;
  const Options options = OptionsOf(loaded.plant);
  try {
    const json plant = json::parse(loaded.policy.About("plant"));
    for (const Option& option : options.all()) {
      option.Set(FormatNumber(plant.at(option.name).get<double>()), option.name);
    }
  } catch (const std::exception& error) {
    throw BadInput(Concat(file.string(), ": metadata \"plant\": ", error.what()));
  }
  const auto model = loaded.policy.about().find("model");
  if (model != loaded.policy.about().end()) loaded.mjcf = model->second;
  return loaded;
}

std::map<std::string, std::string> AboutTask(const Config& config) {
  json plant;
  for (const auto& [name, value] : PlantValues(config.plant)) plant[name] = value;
  json observation{
      {"names", {"cos q1", "sin q1", "w1", "cos q2", "sin q2", "w2", "energy", "height"}},
      {"max_velocity", {kMaxVelocity1, kMaxVelocity2}}};
  if (config.memory > 0) {
    observation["memory"] = {{"steps", config.memory},
                             {"names", {"change of w1", "change of w2", "torque"}},
                             {"velocity", kMemoryVelocity},
                             {"torque", kMemoryTorque}};
  }
  std::map<std::string, std::string> about{
      {"agent", config.agent},
      {"seed", std::to_string(config.train.seed)},
      {"upswing_version", UPSWING_VERSION},
      {"config", ConfigToml(config, true)},
      {"plant", plant.dump()},
      {"control_period", FormatNumber(kControlPeriod)},
      {"observation", observation.dump()},
  };
  if (!config.mjcf.empty()) about["model"] = config.mjcf;
  return about;
}

Plant ChangedPlant(const Plant& base, const std::string& model, const std::vector<std::string>& set,
                   std::string& mjcf) {
  Plant plant = base;
  const Options options = OptionsOf(plant);
  if (!model.empty()) {
    mjcf = ReadTextFile(model);
    if (!IsUtf8(mjcf)) throw BadInput(Concat(model, ": expected UTF-8 text"));
    plant = PlantOf(*LoadModel(mjcf, model));
  }
  for (const std::string& change : set) {
    const size_t equals = change.find('=');
    if (equals == std::string::npos) {
      throw BadInput(Concat("--set: expected NAME=VALUE, got \"", change, "\""));
    }
    const std::string name(Trim(std::string_view(change).substr(0, equals)));
    options.Set(name, Trim(std::string_view(change).substr(equals + 1)), "--set " + name);
  }
  return plant;
}

}  // namespace upswing
