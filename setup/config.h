#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "core/options.h"
#include "rl/dqn_config.h"
#include "rl/ppo_config.h"
#include "rl/sac_config.h"
#include "rl/trainer.h"
#include "setup/task.h"
#include "sim/double_pendulum.h"

namespace upswing {

/// How many past steps an observation may remember.
inline constexpr int kMostMemory = 100;

/// Evaluations in the closed form, and once more in MuJoCo where they are passed there.
inline constexpr std::string_view kScreened = "screened";

/// Names of the learning algorithms; the first is the usual one.
const std::vector<std::string>& AlgorithmNames();

/// All settings of a training. Those of an agent exist for its algorithm alone: the same name may
/// mean another number, with another default, in another algorithm.
struct Config {
  std::string agent = "d3qn";  // the named agent that the other settings began with
  std::string algorithm;       // of AlgorithmNames
  std::string model;  // path of an MJCF file instead of the built-in model; empty: built-in
  TrainConfig train;
  std::string task = kDoublePendulum;  // see TaskNames
  double episode_seconds = 4, random_start_share = 0.9, random_start_velocity = 5;
  int64_t memory = 0;
  bool identify = false;
  std::string physics = "mujoco";       // engine of training, see FindEngine
  std::string eval_physics{kScreened};  // engine of evaluations, or kScreened
  Plant plant;
  Disturbance disturbance;
  Randomization randomization;
  RewardWeights reward;
  DqnConfig dqn;
  SacConfig sac;
  PpoConfig ppo;

  std::string mjcf;  // the text of `model`; not a setting

  /// The defaults of an algorithm, by default the usual one.
  explicit Config(std::string_view algorithm_name = AlgorithmNames().front())
      : algorithm(algorithm_name) {}
  /// Those of the algorithm.
  AgentConfig& learner();
  const AgentConfig& learner() const { return const_cast<Config*>(this)->learner(); }

  /// All of them, of the learners that of the algorithm.
  void Describe(Options& options);
  /// Those that a task without a plant does not have.
  void DescribePlantTask(Options& options);
  /// Those of the double pendulum's environments.
  void DescribeEnvironment(Options& options);

  /// Training environments as these settings have them, in the closed form; `physics` names the
  /// engine that they are to have.
  EnvConfig Environments() const;
  EnvSpec Spec() const { return SpecOf(Environments()); }

  /// A new agent for such environments, whose work the pool shares.
  std::unique_ptr<Agent> MakeAgent(const EnvSpec& spec, ThreadPool& pool) const {
    return learner().Make(spec, static_cast<uint64_t>(train.seed), pool);
  }
};

/// The settings of all algorithms, each name once; they point into `scratch`.
Options EverySetting(Config& scratch);

/// The settings of a configuration. For a name that only other algorithms have, WhyMissing names
/// them.
Options KnownOptions(Config& config);

/// A setting given on the command line or in a study: name (or that of an alias), text, and where,
/// which begins messages; an empty place stands for the flag of that name.
struct FlagValue {
  std::string name, text;
  std::string where = {};
};

/// Sets what the flags say. Throws BadInput.
void SetFlags(const Options& options, const std::vector<FlagValue>& flags);

/// A model file: its path, as settings name it, its text and its plant.
struct ModelFile {
  std::string path, mjcf;
  Plant plant;
};

/// Reads the model that settings name; `in_file`: those of a configuration file, to whose folder
/// the path is relative. Throws BadInput.
using ModelReader = std::function<ModelFile(const std::string& path, bool in_file)>;

/// Builds the settings in their order: defaults < named agent < configuration file, of which this
/// is the text, < flags; a model file's plant counts as defaults. `where` names the file in
/// messages. Throws BadInput, also if settings contradict each other.
Config ParseConfig(std::string_view text, const std::string& where,
                   const std::vector<FlagValue>& flags, const ModelReader& read_model);

/// The settings, such as agent.gamma, that are missing in the TOML text of a run: another version
/// of the program wrote it.
std::vector<std::string> MissingSettings(const std::string& text, const std::string& where,
                                         bool identity_only);

/// The settings in a TOML document, over the defaults of its algorithm. `where` names it in
/// messages, which give the line too. Throws BadInput.
Config ConfigIn(std::string_view toml, const std::string& where);

/// Applies a TOML document, as ConfigIn does.
void ApplyToml(const Options& options, std::string_view toml, const std::string& where);

/// Throws BadInput that names the first of the settings for which `counts` is true that two
/// configurations do not have in common. `where` is what was made with the one `before`.
void ExpectSameSettings(const Config& before, const Config& now, const std::string& where,
                        const std::function<bool(const Option&)>& counts);

/// The settings as TOML; if `identity_only`, only those that change the training (not, for example,
/// the number of threads).
std::string ConfigToml(const Config& config, bool identity_only);

/// A plant's values as text: `mass1 1, mass2 1, …`.
std::string PlantText(const Plant& plant);

/// Names of the agents in configs/, in alphabetical order, and what each is.
std::vector<std::pair<std::string, std::string>> NamedAgents();

/// Sets what --set, or another flag like it, gives ("mass2=1.2") and returns it. Throws BadInput.
std::vector<const Option*> ApplyChanges(const Options& options, const std::vector<std::string>& set,
                                        const std::string& flag = "--set");

}  // namespace upswing
