#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "agents/foreign_task.h"
#include "base/options.h"
#include "pendulum/task_config.h"
#include "rl/dqn/dqn_config.h"
#include "rl/ppo/ppo_config.h"
#include "rl/sac/sac_config.h"
#include "rl/train/trainer.h"

namespace upswing {

/// Largest number of past steps in an observation.
inline constexpr int kMostMemory = 100;

/// Setting: evaluate in the closed form, and confirm passed evaluations in MuJoCo.
inline constexpr std::string_view kScreened = "screened";

/// Names of the learning algorithms; the first is the default.
const std::vector<std::string>& AlgorithmNames();

/// Names of the algorithms whose default settings `can` is true of.
std::vector<std::string> AlgorithmsThat(const std::function<bool(AgentConfig&)>& can);

/// All settings of a training. An agent's settings exist only for its algorithm. The same name can
/// have another meaning and another default in another algorithm.
struct Config {
  std::string agent = "d3qn";  // named agent whose settings are the defaults
  std::string algorithm;       // one of AlgorithmNames
  TrainConfig train;
  std::string start_policy;  // PATH#CHECKSUM of the policy to start from (BuildConfig); or empty
  std::string environment;   // description of a foreign task's environment; empty: double pendulum
  double control_period = kControlPeriod, time_scale = 1, torque_scale = 1;
  double episode_seconds = 4, random_start_share = 0.9, random_start_velocity = 5,
         random_start_drive = 0;
  int64_t memory = 0;
  bool identify = false, any_pose = false;
  std::string physics = "mujoco";       // engine of the training
  std::string eval_physics{kScreened};  // engine of evaluations, or kScreened
  Plant plant;
  Disturbance disturbance;
  Randomization randomization;
  RewardConfig reward;
  DqnConfig dqn;
  SacConfig sac;
  PpoConfig ppo;

  /// The default settings of an algorithm.
  explicit Config(std::string_view algorithm_name = AlgorithmNames().front())
      : algorithm(algorithm_name) {}
  /// The settings of the algorithm.
  AgentConfig& learner();
  const AgentConfig& learner() const;

  /// Describes all settings. Of the learners, only the settings of `algorithm`.
  void Describe(Options& options);
  /// Describes the settings of the double pendulum's environments.
  void DescribeEnvironment(Options& options);

  /// Units of observations and of the built-in reward.
  Scale scale() const { return {time_scale, torque_scale}; }
  /// The training environments of these settings, in the closed form. The caller must set the
  /// engine that `physics` names.
  EnvConfig Environments() const;
  EnvSpec Spec() const { return SpecOf(Environments()); }
  /// Whether Python makes and steps the environments.
  bool is_foreign() const { return !environment.empty(); }

  /// Makes an agent for environments of this kind. The threads of the pool share its work.
  std::unique_ptr<Agent> MakeAgent(const EnvSpec& spec, ThreadPool& pool) const;
};

/// The default settings of all algorithms, each name once.
Options EverySetting();

/// The settings of a configuration. For a name that only other algorithms have, WhyMissing names
/// those algorithms.
Options KnownOptions(Config& config);

/// A setting from the command line or a study: its name or alias, its text, and its place for
/// messages. An empty place stands for the flag of that name.
struct FlagValue {
  std::string name, text;
  std::string where = {};
};

/// Applies flags to the options. Throws BadInput.
void SetFlags(const Options& options, const std::vector<FlagValue>& flags);

/// Runs a check whose message begins with the name of a setting. If a flag of the command line set
/// it, the message begins with the flag, otherwise with `where` and the name.
void CheckNamingFlags(const std::vector<FlagValue>& flags, const std::string& where,
                      const std::function<void()>& check);

/// Builds the settings from four layers, each over the one before: defaults, named agent,
/// configuration file (`text`), flags. `where` names the file in messages. Throws BadInput, also if
/// settings contradict each other.
Config ParseConfig(std::string_view text, const std::string& where,
                   const std::vector<FlagValue>& flags);

/// The settings of a TOML document over the defaults of its algorithm. `where` names the document
/// in messages, which also give the line. Throws BadInput.
Config ConfigIn(std::string_view toml, const std::string& where);

/// The settings that a version of the program recorded for a training, in a run or a policy file.
struct RecordedConfig {
  Config config;                     // missing settings have their defaults
  std::vector<std::string> missing;  // settings, such as agent.gamma, that the record lacks
  std::vector<std::string> unknown;  // settings of the record that this version lacks
};

/// Reads recorded settings from TOML. `where` names the document in messages. Throws BadInput for
/// values out of range.
RecordedConfig ReadRecord(const std::string& toml, const std::string& where);

/// Applies the settings of a TOML document. `where` names it in messages. Throws BadInput with the
/// line.
void ApplyToml(const Options& options, std::string_view toml, const std::string& where);

/// Compares the settings for which `counts` is true. Throws BadInput that names the first one that
/// differs. `where` names the result of the settings `before`.
void ExpectSameSettings(const Config& before, const Config& now, const std::string& where,
                        const std::function<bool(const Option&)>& counts);

/// The settings as TOML. `identity_only` leaves out settings that do not change the training, such
/// as the number of threads.
std::string ConfigToml(const Config& config, bool identity_only);

/// A plant's values as text: `mass1 1, mass2 1, …`.
std::string PlantText(const Plant& plant);

/// Names and descriptions of the agents in configs/, in alphabetical order.
std::vector<std::pair<std::string, std::string>> NamedAgents();

/// Applies the values of --set or a similar flag ("mass2=1.2") and returns the changed options.
/// Throws BadInput.
std::vector<const Option*> ApplyChanges(const Options& options, const std::vector<std::string>& set,
                                        const std::string& flag = "--set");

}  // namespace upswing
