#include "cli/commands.h"

#include "agents/arguments.h"
#include "agents/controllers.h"
#include "base/error.h"
#include "base/text.h"
#include "cli/say.h"
#include "report/figure.h"
#include "runs/plant_file.h"

namespace upswing {
namespace {

/// The settings of a plant whose defaults are those of another one.
Options PlantFlags(Plant& plant) {
  const Options settings = OptionsOf(plant);
  Options flags;
  flags.Section("plant");
  for (const Option& option : settings.all()) {
    Option& flag = flags.Add(std::get<double*>(option.target), option.name, option.range,
                             option.unit, option.help);
    flag.step = option.step;
    flag.sentinel = option.sentinel;
    flag.usual = "as in the plant";
  }
  for (const auto& alias : settings.aliases()) flags.Alias(alias.name, alias.members, alias.help);
  return flags;
}

/// Warns of a plant that is not to be trusted. The command reports a file that cannot be read.
void WarnOfPlant(const std::string& plant) {
  std::string distrust;
  try {
    distrust = ReadPlantFile(plant).distrust;
  } catch (const Error&) {
    return;
  }
  WarnOfDistrust(plant, distrust);
}

/// Says how a policy is carried over to a plant of another size.
void SayIfCarriedOver(const LoadedPolicy& loaded) {
  const Scale& ratio = loaded.carried_over;
  if (ratio == Scale()) return;
  std::string how = "designed for this plant, with";
  if (!loaded.design_for) {
    how = fmt::format(
        "carried over to a plant of another size, with times × {:.4g} and torques × {:.4g}:",
        ratio.time, ratio.torque);
  }
  SayError(fmt::format("{}: {} a decision every {:.4g} s", Printable(loaded.name), how,
                       loaded.control_period()));
}

/// Says that the motor of a plant is at another joint than a policy or controller knows. `loaded`
/// has its own plant still.
void SayIfOtherMotor(const LoadedPolicy& loaded, const Plant& plant) {
  const double known = loaded.plant.actuated_joint, here = plant.actuated_joint;
  if (known == here) return;
  SayError(fmt::format("{}: its {} has the motor at joint {}, this plant has it at joint {}",
                       Printable(loaded.name), loaded.origin(), known, here));
}

}  // namespace

LoadedPolicy GetPolicyIn(const TrialArguments& trial, PolicyArguments a) {
  a.control_period = trial.control_period;
  LoadedPolicy loaded = GetPolicy(a);
  if (loaded.is_foreign()) return loaded;
  const Plant plant = PlantIn(trial, loaded);
  LoadedPolicy used = ForOtherSize(loaded, plant).value_or(loaded);
  const bool is_designed = used.design_for && used.carried_over != Scale();
  if (!is_designed) SayIfOtherMotor(loaded, plant);
  SayIfCarriedOver(used);
  return used;
}

std::vector<LoadedPolicy> GetPoliciesIn(const TrialArguments& trial,
                                        const std::vector<std::string>& names,
                                        PolicyArguments controllers,
                                        std::vector<Undesigned>* undesigned) {
  controllers.control_period = trial.control_period;
  std::vector<LoadedPolicy> policies;
  for (LoadedPolicy& loaded : GetPolicies(names, controllers, undesigned)) {
    const Plant plant = PlantIn(trial, loaded);
    LoadedPolicy used = loaded;
    try {
      used = ForOtherSize(loaded, plant).value_or(loaded);
    } catch (const Error& error) {
      if (undesigned == nullptr || !loaded.design_for) throw;
      undesigned->push_back({loaded.name, error.what()});
      continue;
    }
    const bool is_designed = used.design_for && (trial.known_plant || used.carried_over != Scale());
    if (!is_designed) SayIfOtherMotor(loaded, plant);
    SayIfCarriedOver(used);
    policies.push_back(std::move(used));
  }
  return policies;
}

void AddPolicy(CommandLine& line, PolicyArguments& a) {
  line.Text(
      "policy", a.name, "POLICY|RUN",
      Concat("policy.safetensors, a run folder, a shipped policy such as sac, or a controller (",
             Join(ControllerNames(), ", "), ")"));
  AddControllers(line, a);
}

std::string PolicyWords() {
  return Concat("policy.safetensors, run folders, shipped policies or controllers (",
                Join(ControllerNames(), ", "), ")");
}

void AddControllers(CommandLine& line, PolicyArguments& a) {
  const ControllerConfig defaults;
  line.Settings(OptionsOf(defaults), a.flags);
  line.Repeated("--made-for", a.made_for, "NAME=VALUE|FILE",
                "change of the controller's design plant, such as mass2=1.2, or a plant file as in "
                "--plant (repeatable)",
                "controller");
}

void AddSeed(CommandLine& line, int64_t& seed, const std::string& what) {
  Options options;
  DescribeSeed(options, &seed, what);
  line.Arguments(options);
}

void AddThreads(CommandLine& line, int64_t& threads) {
  Options options;
  DescribeThreads(options, &threads);
  line.Arguments(options);
}

void AddPhysics(CommandLine& line, std::string& physics) {
  Options options;
  DescribePhysics(options, &physics);
  line.Arguments(options);
}

void AddManyOptions(CommandLine& line, std::string& seeds, int64_t& jobs) {
  line.Text("--seeds", seeds, "SEEDS",
            "seeds, one run each: 10 for 1 to 10, or a list such as 3,5,8-12",
            "a number of seeds or a list such as 3,5,8-12");
  Options options;
  options.Add(&jobs, "jobs", {1, 4096}, "", "number of runs at a time").usual = "one per processor";
  line.Arguments(options);
}

void AddSet(CommandLine& line, std::vector<std::string>& set, const std::string& help) {
  line.Repeated("--set", set, "NAME=VALUE", help + " (repeatable)");
}

void WarnOfDistrust(const std::string& name, const std::string& distrust) {
  if (distrust.empty()) return;
  SayError(Concat("warning: ", Printable(name), ": not to be trusted: ", Printable(distrust)));
}

void AddPlant(CommandLine& line, std::string& plant) {
  line.Text("--plant", plant, "FILE|NAME",
            Concat("plant file (TOML with a table [plant]) or shipped plant (",
                   Join(NamesOf(EmbeddedPlants()), ", "), "), which other flags change"));
  line.Check([&plant] {
    if (!plant.empty()) WarnOfPlant(plant);
  });
}

void AddOverwrite(CommandLine& line, bool& overwrite) {
  line.Flag("--overwrite", overwrite, "replace the file that is written, if it exists");
}

void AddUnknownPlant(CommandLine& line, bool& unknown_plant) {
  line.Flag("--unknown-plant", unknown_plant,
            "scale observed energy and height by the training's plant, not the episode's");
}

void AddPlantFlags(CommandLine& line, std::vector<FlagValue>& flags) {
  Plant plant;
  line.Settings(PlantFlags(plant), flags);
  line.Check([&flags] {
    Plant scratch;
    SetFlags(OptionsOf(scratch), flags);
  });
}

void AddTrialOptions(CommandLine& line, TrialArguments& a, const std::string& seed_of) {
  AddSeed(line, a.seed, seed_of);
  AddPlant(line, a.plant);
  AddSet(line, a.set);
  AddPhysics(line, a.physics);
  AddUnknownPlant(line, a.unknown_plant);
  Options own;
  DescribeControlPeriod(own, &a.control_period);
  DescribeGoal(own, &a.goal);
  line.Arguments(own);
  AddPlantFlags(line, a.plant_flags);
  const TrialConditions defaults;
  line.Settings(OptionsOf(defaults), a.flags);
  // Mistakes on the command line are reported before any file is read.
  line.Check([&a] { (void)ConditionsOf(a.flags); });
}

void AddEpisodeOptions(CommandLine& line, TrialArguments& a) {
  line.Text("--start", a.start, "q1,q2,w1,w2",
            "start state in rad and rad/s, or with units, such as 180deg,0,0,-90deg/s (default "
            "0,0,0,0: hanging)",
            "4 numbers q1,q2,w1,w2");
  Options own;
  own.Add(&a.episode, "episode", {0, 999999}, "",
          "index of the episode of `eval` with the same flags")
      .usual = "none";
  line.Arguments(own);
}

void SayIfNoFigures() {
  try {
    CheckCanDraw();
  } catch (const Error& error) {
    SayError(Concat("tables only, no figures: ", error.what()));
  }
}

}  // namespace upswing
