#include "agents/config.h"

#include "agents/algorithms.h"
#include "base/error.h"
#include "base/text.h"
#include "pendulum/physics.h"

namespace upswing {

const std::vector<std::string>& AlgorithmNames() {
  static const std::vector<std::string> kNames = [] {
    std::vector<std::string> names;
    for (const Algorithm& algorithm : Algorithms()) names.push_back(algorithm.name);
    return names;
  }();
  return kNames;
}

std::vector<std::string> AlgorithmsThat(const std::function<bool(AgentConfig&)>& can) {
  std::vector<std::string> names;
  for (const std::string& name : AlgorithmNames()) {
    Config defaults(name);
    if (can(defaults.learner())) names.push_back(name);
  }
  return names;
}

AgentConfig& Config::learner() { return AlgorithmOf(*this).settings(*this); }

const AgentConfig& Config::learner() const { return AlgorithmOf(*this).settings_of_const(*this); }

std::unique_ptr<Agent> Config::MakeAgent(const EnvSpec& spec, ThreadPool& pool) const {
  return AlgorithmOf(*this).make(*this, spec, static_cast<uint64_t>(train.seed), pool);
}

void Config::Describe(Options& o) {
  o.Section("train");
  o.Add(&agent, "agent", "named agent that sets the defaults of the other settings");
  o.AddChoice(&algorithm, "algorithm", AlgorithmNames(),
              "learning algorithm; each has its own settings");
  o.Add(&start_policy, "start_policy",
        "policy whose weights the training starts with: a file, a run folder or a shipped policy, "
        "with the network of the agent (dqn and sac)");
  o.Alias("from", {"start_policy"});
  train.Describe(o);
  o.Section("task");
  o.Add(&environment, "environment",
        "environment of Gymnasium, as upswing.train(env=...) in Python describes it; empty: double "
        "pendulum");
  DescribeEnvironment(o);
  learner().Describe(o);
}

void Config::DescribeEnvironment(Options& o) {
  o.Section("task");
  o.Add(&control_period, "control_period", {kShortestPeriod, kLongestPeriod}, "s",
        "time for which the agent holds a torque; gamma and SAC's n_step follow it unless you give "
        "them");
  constexpr Range kScale{1e-6, 1e6};
  o.Add(&time_scale, "time_scale", kScale, "",
        "natural time of the plant over that of the built-in plant; by it, times and velocities in "
        "observations, reward and evaluations")
      .usual = "the plant's own; 1 if it is about as large as the agent's plant";
  o.Add(&torque_scale, "torque_scale", kScale, "",
        "natural torque of the plant over that of the built-in plant; by it, torques in "
        "observations "
        "and reward")
      .usual = "as time_scale";
  o.Add(&episode_seconds, "episode_seconds", {0.001, 1e6}, "s", "length of a training episode");
  o.Add(&random_start_share, "random_start_share", kZeroToOne, "",
        "share of training episodes that start in a random state instead of hanging");
  o.Add(&random_start_velocity, "random_start_velocity", {0, 50}, "rad/s",
        "largest velocity of random start states");
  o.Add(
      &random_start_drive, "random_start_drive", {0, 10}, "s",
      "time for which motors at both joints drive the links towards a random pose before a random "
      "start, in place of random angles and velocities; 0: none");
  o.Add(&memory, "memory", {0, kMostMemory}, "steps",
        "number of past steps whose torque and velocity changes the agent observes");
  o.Add(&identify, "identify",
        "let the agent observe an estimate of the plant's constants, identified from its motion");
  o.Add(&any_pose, "any_pose",
        "ask each episode for one of the four poses at rest, each link up or down; the agent "
        "observes which");
  o.AddChoice(
      &physics, "physics", EngineNames(),
      "physics engine of the training; closed-form is faster than mujoco, with the same physics");
  std::vector<std::string> judges = EngineNames();
  judges.insert(judges.begin(), std::string(kScreened));
  o.AddChoice(&eval_physics, "eval_physics", judges,
              "physics engine of evaluations; screened: closed-form, and mujoco confirms a solved "
              "task");
  o.Section("plant");
  plant.Describe(o);
  disturbance.Describe(o);
  randomization.Describe(o);
  reward.Describe(o);
}

Options EverySetting() {
  Options options;
  for (const std::string& name : AlgorithmNames()) {
    const Config defaults(name);
    options.AddMissing(OptionsOf(defaults));
  }
  return options;
}

EnvConfig Config::Environments() const {
  EnvConfig env;
  env.environment = environment;
  env.plants = {plant};
  env.disturbances = {disturbance};
  env.randomization = randomization;
  env.num_envs = static_cast<int>(train.envs);
  env.evaluations = static_cast<int>(train.eval_episodes);
  env.control_period = control_period;
  env.scale = scale();
  env.episode_seconds = episode_seconds;
  env.memory = static_cast<int>(memory);
  if (identify) env.identified_from = plant;
  env.any_pose = any_pose;
  env.start = {.noise = train.start_noise,
               .random_share = random_start_share,
               .random_velocity = random_start_velocity,
               .random_drive = random_start_drive};
  env.reward = reward;
  env.seed = static_cast<uint64_t>(train.seed);
  env.stream = "training environment";
  return env;
}

void ExpectSameSettings(const Config& before, const Config& now, const std::string& where,
                        const std::function<bool(const Option&)>& counts) {
  for (const auto& [option, old] : Differences(OptionsOf(now), OptionsOf(before))) {
    if (!counts(option)) continue;
    throw BadInput(Concat(where, ": made with ", option.section, ".", option.name, " = ",
                          old ? old->text() : "none", ", but the configuration has ",
                          option.text()));
  }
}

std::string ConfigToml(const Config& config, bool identity_only) {
  return OptionsOf(config).Toml(
      !identity_only, [&](const Option& option) { return !identity_only || option.identity(); });
}

std::string PlantText(const Plant& plant) {
  std::vector<std::string> texts;
  for (const auto& [name, value] : PlantValues(plant)) {
    texts.push_back(Concat(name, " ", FormatNumber(value)));
  }
  return Join(texts, ", ");
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

}  // namespace upswing
