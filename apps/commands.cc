#include "apps/commands.h"

#include <array>

#include "core/text.h"
#include "setup/arguments.h"
#include "setup/controllers.h"

namespace upswing {
namespace {

/// What --help shows for a flag's value.
std::string TypeName(const Option& option) {
  constexpr std::array kNames{"", "INTEGER", "NUMBER", "TEXT", "LIST"};  // in Target's order
  return option.name == "model" ? "FILE" : kNames.at(option.target.index());
}

/// What is done with a flag's value.
using TakeValue = std::function<void(const std::string&)>;

/// Adds the flag of one setting; of several values the last counts.
void AddFlag(CLI::App& app, const Option& option, const std::string& group, const TakeValue& take) {
  const std::string help = option.about_with_default();
  if (std::holds_alternative<bool*>(option.target)) {
    app.add_flag_function(
           option.flag() + ",!--no-" + option.flag().substr(2),
           [take](int64_t on) { take(on > 0 ? "true" : "false"); }, help)
        ->group(group)
        ->disable_flag_override();
    return;
  }
  app.add_option_function<std::string>(option.flag(), take, help)
      ->group(group)
      ->multi_option_policy(CLI::MultiOptionPolicy::TakeLast)
      ->type_name(TypeName(option));
}

}  // namespace

CLI::Validator NotEmpty(const std::string& what) {
  return {[what](const std::string& text) -> std::string {
            return text.empty() ? Concat("expected ", what, ", got an empty text") : "";
          },
          ""};
}

CLI::Option* AddPolicy(CLI::App& app, PolicyArguments& a) {
  CLI::Option* policy = app.add_option(
      "policy", a.name,
      Concat("policy.safetensors, run folder or controller: ", Join(ControllerNames(), ", ")));
  policy->type_name("POLICY|RUN")->check(NotEmpty());
  AddControllers(app, a);
  return policy;
}

void AddControllers(CLI::App& app, PolicyArguments& a) {
  ControllerConfig defaults;
  AddSettings(app, OptionsOf(defaults), a.flags);
  app.add_option("--made-for", a.made_for,
                 "plant that a controller is made for, such as mass2=1.2 (repeat for more)")
      ->group("controller")
      ->type_name("NAME=VALUE")
      ->take_all()
      ->allow_extra_args(false);
}

void AddStart(CLI::App& app, std::optional<std::string>& start) {
  app.add_option("--start", start, "where it begins, rad and rad/s [0,0,0,0: hanging]")
      ->type_name("q1,q2,w1,w2");
}

void AddSeed(CLI::App& app, int64_t& seed, const std::string& what) {
  Options options;
  DescribeSeed(options, &seed, what);
  AddArguments(app, options);
}

void AddThreads(CLI::App& app, int64_t& threads) {
  Options options;
  DescribeThreads(options, &threads);
  AddArguments(app, options);
}

void AddPhysics(CLI::App& app, std::string& physics) {
  Options options;
  DescribePhysics(options, &physics);
  AddArguments(app, options);
}

void AddManyOptions(CLI::App& app, std::string& seeds, int64_t& jobs) {
  const auto not_empty = [](const std::string& text) -> std::string {
    return text.empty() ? "expected a number of seeds or a list such as 3,5,8-12, got \"\"" : "";
  };
  app.add_option("--seeds", seeds, "a run for each: 10 for 1 to 10, or a list such as 3,5,8-12")
      ->type_name("SEEDS")
      ->check(CLI::Validator(not_empty, ""));
  Options options;
  options.Add(&jobs, "jobs", {1, 4096}, "", "runs at a time").usual = "one for each processor";
  AddArguments(app, options);
}

void AddSet(CLI::App& app, std::vector<std::string>& set, const std::string& help) {
  app.add_option("--set", set, help + " (repeat for more)")
      ->type_name("NAME=VALUE")
      ->take_all()
      ->allow_extra_args(false);
}

void AddPlantOptions(CLI::App& app, std::vector<std::string>& set, std::string& model) {
  AddSet(app, set, "another plant, such as mass2=1.2");
  app.add_option("--model", model, "MJCF file to use instead of the policy's model")
      ->type_name("FILE")
      ->check(NotEmpty());
}

void AddUnknownPlant(CLI::App& app, bool& unknown_plant) {
  app.add_flag("--unknown-plant", unknown_plant,
               "scale the observed energy and height by the training's plant")
      ->disable_flag_override();
}

void AddArguments(CLI::App& app, const Options& options) {
  for (const Option& option : options.all()) {
    AddFlag(app, option, "Options",
            [option](const std::string& text) { option.Set(text, option.flag()); });
  }
}

void AddSettings(CLI::App& app, const Options& options, std::vector<FlagValue>& flags) {
  // CLI11 applies flags in this order: aliases first, so that what is more specific wins.
  for (const auto& alias : options.aliases()) {
    Option as_one = *options.Find(alias.name, alias.name).front();
    as_one.help = alias.help;
    app.add_option_function<std::string>(
           alias.flag(),
           [&flags, name = alias.name](const std::string& text) {
             flags.push_back({name, text});
           },
           as_one.about())
        ->group(alias.section)
        ->multi_option_policy(CLI::MultiOptionPolicy::TakeLast)
        ->type_name("NUMBER");
  }
  for (const Option& option : options.all()) {
    AddFlag(app, option, option.section, [&flags, name = option.name](const std::string& text) {
      flags.push_back({name, text});
    });
  }
}

void ShowDefaults(CLI::App& app, const Options& every, const Options& options) {
  for (const Option& option : every.all()) {
    CLI::Option* flag = app.get_option(option.flag());
    const Option* shown = options.Get(option.name);
    flag->group(shown == nullptr ? "" : shown->section);
    if (shown != nullptr) flag->description(shown->about_with_default());
  }
}

}  // namespace upswing
