#include "python/src/environment_settings.h"

#include <algorithm>
#include <array>
#include <string_view>

#include "core/error.h"
#include "core/text.h"
#include "run/config_files.h"
#include "setup/config_checks.h"

namespace upswing {

bool IsEnvironmentSetting(const Option& option) {
  constexpr std::array<std::string_view, 4> kMore{"agent", "envs", "threads", "start_noise"};
  Config scratch;
  Options of_environment;
  scratch.DescribeEnvironment(of_environment);
  return (of_environment.Get(option.name) != nullptr && option.name != "eval_physics") ||
         std::ranges::find(kMore, option.name) != kMore.end();
}

Config EnvironmentConfig(const std::vector<FlagValue>& flags) {
  Config scratch;
  const Options every = EverySetting(scratch);
  for (const FlagValue& flag : flags) {
    for (const Option* option : every.Find(flag.name, flag.where)) {
      if (IsEnvironmentSetting(*option)) continue;
      throw BadInput(Concat(flag.where, ": expected a setting of an environment, and ", flag.name,
                            " is one of a training alone"));
    }
  }
  Config config = BuildConfig("", flags);
  if (!HasPlant(config.task)) {
    throw BadInput(Concat("agent: expected one of the task ", kDoublePendulum, ", got ",
                          config.agent, ", which learns ", config.task));
  }
  return config;
}

void SetSurroundings(const std::vector<FlagValue>& flags, TrialArguments& trial) {
  TrialSurroundings scratch;
  const Options options = OptionsOf(scratch), plant = OptionsOf(scratch.plant);
  const auto in_plant = [&](const Option* option) { return plant.Get(option->name) != nullptr; };
  for (const FlagValue& flag : flags) {
    const std::vector<const Option*> found = options.Find(flag.name, flag.where);
    if (in_plant(found.front())) {
      trial.set.push_back(Concat(flag.name, "=", flag.text));
    } else {
      trial.flags.push_back(flag);
    }
  }
}

}  // namespace upswing
