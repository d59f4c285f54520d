#include "apps/commands.h"

#include "core/text.h"
#include "run/find_policy.h"
#include "setup/arguments.h"
#include "setup/controllers.h"

namespace upswing {

void AddPolicy(CommandLine& line, PolicyArguments& a) {
  line.Text(
      "policy", a.name, "POLICY|RUN",
      Concat("policy.safetensors, run folder or controller: ", Join(ControllerNames(), ", ")));
  AddControllers(line, a);
}

void AddControllers(CommandLine& line, PolicyArguments& a) {
  const ControllerConfig defaults;
  line.Settings(OptionsOf(defaults), a.flags);
  line.Repeated("--made-for", a.made_for, "NAME=VALUE",
                "plant that a controller is made for, such as mass2=1.2 (repeat for more)",
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
  line.Text("--seeds", seeds, "SEEDS", "a run for each: 10 for 1 to 10, or a list such as 3,5,8-12",
            "a number of seeds or a list such as 3,5,8-12");
  Options options;
  options.Add(&jobs, "jobs", {1, 4096}, "", "runs at a time").usual = "one for each processor";
  line.Arguments(options);
}

void AddSet(CommandLine& line, std::vector<std::string>& set, const std::string& help) {
  line.Repeated("--set", set, "NAME=VALUE", help + " (repeat for more)");
}

void AddUnknownPlant(CommandLine& line, bool& unknown_plant) {
  line.Flag("--unknown-plant", unknown_plant,
            "scale the observed energy and height by the training's plant");
}

void AddTrialOptions(CommandLine& line, TrialArguments& a, const std::string& seed_of) {
  AddSeed(line, a.seed, seed_of);
  AddSet(line, a.set, "another plant, such as mass2=1.2");
  line.Text("--model", a.model, "FILE", "MJCF file to use instead of the policy's model");
  AddPhysics(line, a.physics);
  AddUnknownPlant(line, a.unknown_plant);
  const TrialConditions defaults;
  line.Settings(OptionsOf(defaults), a.flags);
  // Mistakes on the command line are reported before any file is read.
  line.Check([&a] { (void)ConditionsOf(a); });
}

void AddEpisodeOptions(CommandLine& line, TrialArguments& a) {
  line.Text("--start", a.start, "q1,q2,w1,w2", "where it begins, rad and rad/s [0,0,0,0: hanging]",
            "");
  Options own;
  own.Add(&a.episode, "episode", {0, 999999}, "", "that of `eval` with the same flags, from 0")
      .usual = "none";
  line.Arguments(own);
}

}  // namespace upswing
