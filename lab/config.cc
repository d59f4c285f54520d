#include "lab/config.h"

#include <algorithm>
#include <array>
#include <map>

#include "core/error.h"
#include "core/text.h"
#include "io/file.h"
#include "io/run_folder.h"
#include "io/streams.h"
#include "lab/named_agents.h"
#include "lab/toml_settings.h"
#include "mujoco/engines.h"
#include "mujoco/mjcf_check.h"
#include "mujoco/model.h"
#include "rl/dqn.h"
#include "rl/ppo.h"
#include "rl/sac.h"

namespace upswing {
namespace {

namespace fs = std::filesystem;

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
  bool in_file = false;
};

EarlySetting FindEarly(std::string_view section, std::string_view key, const toml::table& file,
                       const std::string& file_name, const std::vector<FlagValue>& flags) {
  EarlySetting setting;
  if (const auto* node = file[section][key].as_string()) {
    setting = {node->get(), Concat(PlaceOf(*node, file_name), ": ", key), true};
  }
  for (const auto& [name, text, where] : flags) {
    if (name == key) setting = {text, where.empty() ? FlagOf(name) : where};
  }
  return setting;
}

/// Throws BadInput that begins with `place` if settings of an agent with a replay memory, each of
/// which is allowed, contradict each other, so that nothing could be learned.
void CheckTogether(const OffPolicyConfig& d, const std::string& place) {
  if (d.batch > d.replay) {
    throw BadInput(Concat(place,
                          "batch: expected at most as many transitions as the replay memory holds "
                          "(replay ",
                          d.replay, "), got ", d.batch));
  }
  if (d.learning_starts > d.replay) {
    throw BadInput(Concat(place,
                          "learning_starts: expected at most as many steps as the replay memory "
                          "holds transitions (replay ",
                          d.replay, "), got ", d.learning_starts));
  }
}

/// Throws BadInput that begins with `place` if minibatches do not divide a rollout, or if there is
/// a setting of the other kind of actions that is not at its default.
void CheckPpo(const PpoConfig& p, int64_t num_envs, const std::string& place) {
  try {
    p.CheckBatch(num_envs);
  } catch (const Error& error) {
    throw BadInput(place + error.what());
  }
  const PpoConfig usual;
  if (!p.discrete() && p.levels != usual.levels) {
    throw BadInput(Concat(place, "levels: expected none with continuous actions, got ", p.levels,
                          " (or actions = levels)"));
  }
  if (!p.discrete() && p.initial_std > p.max_std && p.initial_std != usual.initial_std) {
    throw BadInput(Concat(place, "initial_std: expected at most max_std (", p.max_std, "), got ",
                          p.initial_std));
  }
  if (p.discrete() && p.initial_std != usual.initial_std) {
    throw BadInput(
        Concat(place, "initial_std: expected none with actions = levels, got ", p.initial_std));
  }
}

/// Throws BadInput that begins with `place` unless the bins of a categorical critic can stand for
/// different values.
void CheckBins(const SacConfig& s, const std::string& place) {
  if (s.bins == 1) throw BadInput(Concat(place, "bins: expected 0 or at least 2, got 1"));
  if (s.bins > 0 && s.value_low >= s.value_high) {
    throw BadInput(Concat(place, "value_low: expected less than value_high (", s.value_high,
                          "), got ", s.value_low));
  }
}

/// Throws BadInput if a setting of the double pendulum is not at its default in another task, which
/// has no such setting.
void CheckTask(Config& config, const std::string& where) {
  if (config.task == kDoublePendulum) return;
  constexpr std::array<std::string_view, 5> kSections{"task", "plant", "disturbance", "randomize",
                                                      "reward"};
  constexpr std::array<std::string_view, 3> kCurriculum{"start_noise", "start_noise_end",
                                                        "curriculum_steps"};
  Config defaults(config.algorithm);
  const Options now = OptionsOf(config), usual = OptionsOf(defaults);
  for (size_t i = 0; i < now.all().size(); ++i) {
    const Option& option = now.all()[i];
    const bool of_pendulum = (option.name != "task" &&
                              std::ranges::find(kSections, option.section) != kSections.end()) ||
                             std::ranges::find(kCurriculum, option.name) != kCurriculum.end();
    if (!of_pendulum || option.text() == usual.all()[i].text()) continue;
    throw BadInput(Concat(
        where.empty() ? "" : where + ": ", option.name, ": expected none, as the task ",
        config.task, " has no such setting, got ", option.text(), " (agent ", config.agent, ")"));
  }
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

/// The settings of a configuration, which say of those that other algorithms have whose they are.
Options KnownOptions(Config& config, std::string_view agent) {
  Options options = OptionsOf(config);
  std::map<std::string, std::vector<std::string>> owners;
  for (const std::string& algorithm : AlgorithmNames()) {
    Config other(algorithm);
    const Options of_other = OptionsOf(other);
    for (const Option& option : of_other.all()) owners[option.name].push_back(algorithm);
  }
  for (const auto& [name, algorithms] : owners) {
    if (options.Get(name) != nullptr) continue;
    options.Explain(name, Concat(name, " is a setting of ", Join(algorithms, " and "),
                                 ", but agent ", agent, " learns by ", config.algorithm));
  }
  return options;
}

/// The named agent of a configuration, its settings and its algorithm.
struct ChosenAgent {
  std::string_view name;
  std::string place;  // for messages
  toml::table settings;
  std::string algorithm;
};

/// Throws BadInput if there is no such agent, or if it does not learn by the algorithm that is
/// asked for.
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
      throw BadInput(Concat(asked.where, ": agent ", agent.name, " learns by ", algorithm, ", got ",
                            asked.value, "; expected another agent, such as ", asked.value));
    }
  }
  return {agent.name, place, std::move(settings), algorithm};
}

/// The settings of a parsed configuration file; see ParseConfig.
Config ConfigOf(const toml::table& table, const fs::path& file,
                const std::vector<FlagValue>& flags) {
  const std::string where = file.empty() ? "" : InputName(file.string());
  const ChosenAgent agent = ChooseAgent(table, where, flags);
  Config config(agent.algorithm);
  const Options options = KnownOptions(config, agent.name);

  // A model file has a plant of its own, which other settings may change.
  const EarlySetting model = FindEarly("plant", "model", table, where, flags);
  std::string model_path = model.value;
  if (!model_path.empty() && model.in_file) {
    model_path = (file.parent_path() / model.value).string();  // counts from its file
  }
  if (!model_path.empty()) config.plant = ChangedPlant(config.plant, model_path, {}, config.mjcf);

  ApplyTable(options, agent.settings, agent.place, false);
  ApplyTable(options, table, where, false);
  SetFlags(options, flags);
  config.agent = agent.name;
  config.model = model_path;
  const std::string place = where.empty() ? "" : where + ": ";
  if (config.algorithm == kSac) {
    CheckTogether(config.sac, place);
    CheckBins(config.sac, place);
  } else if (config.algorithm == kPpo) {
    CheckPpo(config.ppo, config.train.envs, place);
  } else {
    CheckTogether(config.dqn, place);
  }
  CheckTask(config, where);
  return config;
}

/// The settings that a configuration file lacks; see MissingSettings.
std::vector<std::string> MissingIn(const toml::table& table, const std::string& where,
                                   bool identity_only) {
  Config scratch(AlgorithmIn(table, where));
  const Options options = OptionsOf(scratch);
  std::vector<std::string> missing;
  for (const Option& option : options.all()) {
    const bool needed = !option.implied && (option.identity || !identity_only);
    if (!needed || table[option.section][option.name]) continue;
    missing.push_back(Concat(option.section, ".", option.name));
  }
  return missing;
}

}  // namespace

const std::vector<std::string>& AlgorithmNames() {
  static const std::vector<std::string> kNames{kDqn, kSac, kPpo};
  return kNames;
}

void Config::Describe(Options& o) {
  const std::string chosen = algorithm;
  o.Section("train");
  o.Add(&agent, "agent", "d3qn", "named agent whose settings the others begin with");
  o.AddChoice(&algorithm, "algorithm", AlgorithmNames(),
              "what learns; each algorithm has settings of its own")
      .implied = true;
  algorithm = chosen;
  train.Describe(o);
  o.Section("task");
  o.AddChoice(&task, "task", TaskNames(), "what is to be learned").implied = true;
  o.Add(&episode_seconds, "episode_seconds", 4, {0.02, 1e6}, "s", "length of a training episode")
      .step = kControlPeriod;
  o.Add(&random_start_share, "random_start_share", 0.5, kUnit, "",
        "share of the episodes that begin in a random state instead of hanging");
  o.Add(&random_start_velocity, "random_start_velocity", 5, {0, 50}, "rad/s",
        "largest velocity of these random states");
  o.Add(&memory, "memory", 0, {0, kMostMemory}, "steps",
        "past steps whose torque and change of velocities the agent sees too");
  o.AddChoice(&physics, "physics", EngineNames(),
              "engine to train in; closed-form computes the same physics faster than mujoco");
  std::vector<std::string> judges = EngineNames();
  judges.insert(judges.begin(), std::string(kScreened));
  o.AddChoice(&eval_physics, "eval_physics", judges,
              "engine of the evaluations; screened: in mujoco what succeeds in closed-form");
  o.Section("plant");
  o.Add(&model, "model", "", "MJCF file to use instead of the built-in model");
  plant.Describe(o);
  disturbance.Describe(o);
  randomization.Describe(o);
  reward.Describe(o);
  if (algorithm == kSac) {
    sac.Describe(o);
  } else if (algorithm == kPpo) {
    ppo.Describe(o);
  } else {
    dqn.Describe(o);
  }
}

Options EverySetting(Config& scratch) {
  Options options;
  for (const std::string& name : AlgorithmNames()) {
    scratch.algorithm = name;
    options.AddMissing(OptionsOf(scratch));
  }
  return options;
}

EnvConfig Config::Environments() const {
  EnvConfig env;
  env.task = task;
  env.engine = &FindEngine(physics, "--physics");
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

std::unique_ptr<Agent> Config::MakeAgent(const EnvSpec& spec, ThreadPool& pool) const {
  const auto seed = static_cast<uint64_t>(train.seed);
  if (algorithm == kSac) return std::make_unique<Sac>(sac, spec, seed, pool);
  if (algorithm == kPpo) return std::make_unique<Ppo>(ppo, spec, seed, pool);
  return std::make_unique<Dqn>(dqn, spec, seed, pool);
}

Config ConfigIn(std::string_view text, const std::string& where) {
  const toml::table table = ParseToml(text, where);
  Config config(AlgorithmIn(table, where));
  ApplyTable(OptionsOf(config), table, where, false);
  return config;
}

void ApplyToml(const Options& options, std::string_view text, const std::string& where) {
  ApplyTable(options, ParseToml(text, where), where, false);
}

void ExpectSameSettings(const Options& before, const Options& now, const std::string& where,
                        const std::function<bool(const Option&)>& counts) {
  for (const Option& new_one : now.all()) {
    const Option* old_one = before.Get(new_one.name);
    const std::string old_text = old_one == nullptr ? "none" : old_one->text();
    if (counts(new_one) && old_text != new_one.text()) {
      throw BadInput(Concat(where, ": made with ", new_one.section, ".", new_one.name, " = ",
                            old_text, ", but the configuration says ", new_one.text()));
    }
  }
}

void SetFlags(const Options& options, const std::vector<FlagValue>& flags) {
  for (const auto& [name, value, place] : flags) {
    options.Set(name, value, place.empty() ? FlagOf(name) : place);
  }
}

Config BuildConfig(const fs::path& file, const std::vector<FlagValue>& flags) {
  return ParseConfig(file.empty() ? "" : ReadInput(file.string()), file, flags);
}

Config ParseConfig(std::string_view text, const fs::path& file,
                   const std::vector<FlagValue>& flags) {
  return ConfigOf(ParseToml(text, file.empty() ? "" : InputName(file.string())), file, flags);
}

void NameModelCopy(Config& config) {
  if (!config.mjcf.empty()) config.model = RunFolder::kModel;
}

void MakeReadyForMany(Config& config) {
  if (config.train.threads == 0) config.train.threads = 1;
  NameModelCopy(config);
}

std::vector<std::string> MissingSettings(const std::string& text, const std::string& where,
                                         bool identity_only) {
  return MissingIn(ParseToml(text, where), where, identity_only);
}

std::string CompleteToml(Config config) {
  if (!config.model.empty()) config.model = fs::absolute(config.model).string();
  return ConfigToml(std::move(config), false);
}

Config ReadRunConfig(const fs::path& run, const std::vector<FlagValue>& flags) {
  const fs::path file = run / RunFolder::kConfig;
  const toml::table table = ParseToml(ReadOwnFile(file), file.string());
  const std::string model = table["plant"]["model"].value_or("");
  if (!model.empty() && model != RunFolder::kModel) {  // a run is whole wherever it lies
    throw BadInput(Concat(file.string(), ": model: expected ", RunFolder::kModel,
                          ", the copy in the run folder, got \"", Printable(model), "\""));
  }
  ChooseAgent(table, file.string(), flags);  // whose algorithm says which settings there are
  std::vector<std::string> missing = MissingIn(table, file.string(), false);
  if (missing.empty()) return ConfigOf(table, file, flags);
  constexpr size_t kMostNames = 6;  // that make a line which can still be read
  const size_t more = missing.size() - std::min(missing.size(), kMostNames);
  missing.resize(missing.size() - more);
  throw BadInput(Concat(file.string(), ": expected every setting, as this version writes a run; ",
                        "got none of ", Join(missing, ", "),
                        more > 0 ? Concat(" and ", more, " more") : "",
                        ": another version wrote it"));
}

std::vector<Option> TrainingSettings(Config& config) {
  std::vector<Option> settings;
  const Options options = OptionsOf(config);
  for (const Option& option : options.all()) {
    const bool is_seed = option.target == Option::Target(&config.train.seed);
    if (option.identity && !is_seed) settings.push_back(option);
  }
  return settings;
}

std::string ConfigToml(Config config, bool identity_only) {
  return OptionsOf(config).Toml(
      !identity_only, [&](const Option& option) { return !identity_only || option.identity; });
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
    // The file begins with a comment that says what it is.
    std::vector<std::string> comment;
    for (const std::string_view line : Split(agent.toml, '\n')) {
      if (!line.starts_with('#')) break;
      comment.emplace_back(Trim(line.substr(1)));
    }
    names.emplace_back(agent.name, Join(comment, " "));
  }
  return names;
}

std::vector<const Option*> ApplyChanges(const Options& options, const std::vector<std::string>& set,
                                        const std::string& flag) {
  std::vector<const Option*> changed;
  for (const std::string& change : set) {
    const size_t equals = change.find('=');
    if (equals == std::string::npos) {
      throw BadInput(Concat(flag, ": expected NAME=VALUE, got \"", change, "\""));
    }
    const std::string name(Trim(std::string_view(change).substr(0, equals)));
    const std::string where = Concat(flag, " ", name);
    for (const Option* option : options.Find(name, where)) {
      option->Set(Trim(std::string_view(change).substr(equals + 1)), where);
      changed.push_back(option);
    }
  }
  return changed;
}

Plant ChangedPlant(const Plant& base, const std::string& model, const std::vector<std::string>& set,
                   std::string& mjcf) {
  Plant plant = base;
  const Options options = OptionsOf(plant);
  if (!model.empty()) {
    mjcf = ReadOwnFile(model, kMostMjcfBytes);
    plant = PlantOf(*LoadModel(mjcf, model));
  }
  ApplyChanges(options, set);
  return plant;
}

}  // namespace upswing
