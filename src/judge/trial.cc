#include "judge/trial.h"

#include <algorithm>
#include <cmath>

#include "base/error.h"
#include "base/text.h"
#include "mujoco/engines.h"
#include "os/file.h"
#include "pendulum/start_text.h"
#include "runs/plant_file.h"
#include "runs/run_folder.h"

namespace upswing {
namespace {

namespace fs = std::filesystem;

/// The folder for figures if the user names none.
fs::path DefaultOut(const LoadedPolicy& loaded, const std::string& name) {
  const bool has_file = !loaded.path.empty();
  const fs::path file = loaded.path, run = file.parent_path();
  const std::string stem = has_file ? file.stem().string() : loaded.policy->kind();
  const bool of_run = has_file && fs::exists(run / RunFolder::kConfig);
  return FreePath(of_run ? run / name : fs::path("runs") / Concat(name, "-", stem));
}

}  // namespace

Plant PlantIn(const TrialArguments& trial, const LoadedPolicy& loaded) {
  Plant plant = trial.plant.empty() ? loaded.plant : ReadPlantFile(trial.plant).plant;
  const Options options = OptionsOf(plant);
  SetFlags(options, trial.plant_flags);
  ApplyChanges(options, trial.set);
  return plant;
}

LoadedPolicy UsedIn(const TrialArguments& trial, const LoadedPolicy& loaded) {
  if (loaded.is_foreign()) return loaded;
  return ForOtherSize(loaded, PlantIn(trial, loaded)).value_or(loaded);
}

TrialConditions ConditionsOf(const std::vector<FlagValue>& flags) {
  TrialConditions conditions;
  SetFlags(OptionsOf(conditions), flags);
  return conditions;
}

PendulumEnvConfig TrialEnvironments(const TrialArguments& a, const LoadedPolicy* loaded,
                                    bool draws_goals) {
  if (loaded != nullptr) ExpectPendulum(*loaded);
  PendulumEnvConfig env;
  env.engine = &EngineCalled(a.physics);
  Plant plant = loaded != nullptr ? loaded->plant : Plant();
  std::vector<FlagValue> flags;
  if (!a.plant.empty()) {
    PlantFile file = ReadPlantFile(a.plant);
    plant = file.plant;
    flags = std::move(file.conditions);
  }
  flags.insert(flags.end(), a.flags.begin(), a.flags.end());
  const TrialConditions conditions = ConditionsOf(flags);
  env.disturbances = {conditions.disturbance};
  env.randomization = conditions.randomization;
  if (a.unknown_plant && loaded == nullptr) {
    throw BadInput("--unknown-plant: expected a policy with it, got none");
  }
  env.scale = loaded != nullptr ? loaded->scale() : TaskScaleOf(plant);
  env.episode_seconds = kEvaluationSeconds * env.scale.time;
  env.control_period = kControlPeriod * env.scale.time;
  if (a.control_period > 0) env.control_period = a.control_period;
  if (loaded != nullptr) {
    env.control_period = loaded->control_period();
    env.memory = loaded->memory();
    if (loaded->identifies()) env.identified_from = loaded->plant;
    if (a.unknown_plant) env.assumed_plant = loaded->plant;
    env.any_pose = loaded->seeks_any_pose();
  }
  env.goal = a.goal.empty() ? Pose() : *std::ranges::find(kPoses, a.goal, PoseName);
  // A controller balances only upright, also one whose swing-up is a policy for any pose.
  const bool is_learned = loaded != nullptr && !loaded->design_for;
  if (!(env.any_pose && is_learned) && env.goal != Pose()) {
    throw BadInput(Concat("--goal ", a.goal,
                          ": expected a policy for any pose (train --any-pose), got ",
                          loaded != nullptr ? Printable(loaded->name) : "none"));
  }
  if (draws_goals && is_learned && a.goal.empty()) env.goal.reset();
  SetFlags(OptionsOf(plant), a.plant_flags);
  ApplyChanges(OptionsOf(plant), a.set);
  env.plants = {plant};
  CheckNamingFlags(flags, "", [&] {
    (void)env.randomization.MakePosterior();  // throws if there is none to draw from
    CheckPeriods(env);
  });
  env.seed = static_cast<uint64_t>(a.seed);
  env.stream = "evaluation";
  return env;
}

PendulumEnv OneEpisode(PendulumEnvConfig config, int index) {
  config.num_envs = 1;
  config.first_index += static_cast<uint64_t>(index);
  return PendulumEnv(config);
}

std::string ChangesText(const PendulumEnvConfig& env) {
  const TrialConditions now{env.disturbance(0), env.randomization}, usual;
  std::vector<std::string> texts;
  for (const auto& [option, before] : Differences(OptionsOf(now), OptionsOf(usual))) {
    if (option.name == "posterior") continue;  // numbers of randomize_posterior
    texts.push_back(Concat(option.name, " ", option.text()));
  }
  if (env.assumed_plant) texts.emplace_back("the plant unknown to the policy");
  return Join(texts, ", ");
}

fs::path FigureFolder(const std::string& out, const LoadedPolicy& loaded, const std::string& name) {
  if (out.empty()) return DefaultOut(loaded, name);
  fs::path folder = out;
  for (const char* extension : {".svg", ".png", ".csv"}) {
    if (folder.extension() == extension) {
      throw BadInput(
          Concat("--out: expected a folder for several files, got the name of a file: ", out));
    }
  }
  CheckFree(folder);
  return folder;
}

RolloutConfig TrialEpisode(const TrialArguments& a, const LoadedPolicy* loaded) {
  if (!a.start.empty() && a.is_of_eval()) {
    throw BadInput("--start: expected none with --episode, which has its own start");
  }
  RolloutConfig config;
  if (loaded != nullptr) config.policy = loaded->policy.get();
  config.env = TrialEnvironments(a, loaded, a.is_of_eval());
  config.env.first_index = static_cast<uint64_t>(std::max<int64_t>(0, a.episode));
  if (!a.start.empty()) {
    config.start = ParseState(a.start, "--start");
  } else if (!a.is_of_eval()) {
    config.start = PendulumState();
  }
  return config;
}

}  // namespace upswing
