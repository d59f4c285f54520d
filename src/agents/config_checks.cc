#include "agents/config_checks.h"

#include <algorithm>
#include <cmath>

#include "base/error.h"
#include "base/format.h"
#include "base/text.h"
#include "pendulum/control_period.h"
#include "pendulum/own_reward.h"
#include "pendulum/pendulum_env.h"
#include "pendulum/timestep.h"

namespace upswing {
namespace {

/// Size as text, such as `1.5 GB`.
std::string Gigabytes(double bytes) {
  const auto tenths = std::llround(1e-8 * bytes);
  return Concat(tenths / 10, ".", tenths % 10, " GB");
}

/// Throws BadInput if a setting of the double pendulum differs from its default in another
/// environment.
void CheckForeign(Config& config) {
  const auto settings_of = [](Config& from) {
    Options settings;
    from.train.DescribeCurriculum(settings);
    from.DescribeEnvironment(settings);
    return settings;
  };
  Config defaults;
  const Options now = settings_of(config);
  const Options usual = settings_of(defaults);
  for (const auto& [option, other] : Differences(now, usual)) {
    throw BadInput(Concat(option.name,
                          ": expected none with a Gymnasium environment, which has no such "
                          "setting, got ",
                          option.text()));
  }
}

}  // namespace

void CheckSettings(Config& config) {
  config.learner().Check(config.train.envs);
  (void)config.randomization.MakePosterior();  // throws if there is none to draw from
  if (!config.start_policy.empty() && !config.learner().StartsFromPolicy()) {
    const std::vector<std::string> able =
        AlgorithmsThat([](const AgentConfig& settings) { return settings.StartsFromPolicy(); });
    throw BadInput(Concat("start_policy: expected an agent of ", Join(able, " or "),
                          ", got one of ", config.algorithm));
  }
  if (!config.reward.expression.empty()) (void)OwnReward(config.reward.expression);
  if (config.is_foreign()) return CheckForeign(config);
  const PendulumEnvConfig env = config.Environments();
  CheckPeriods(env);
  ExpectWholePeriods("episode_seconds", env.episode_seconds, env.control_period);
  (void)PhysicsStepsFor(config.plant, config.randomization, env.control_period, "plant");
}

std::vector<std::string> Warnings(const Config& config) {
  // All environments step together, so the last step can exceed the budget.
  const int64_t envs = config.train.envs;
  const int64_t steps = (config.train.steps + envs - 1) / envs * envs;
  std::vector<std::string> warnings = config.learner().Warnings(steps, envs);
  const bool built_in = config.reward.expression.empty();
  if (built_in &&
      std::ranges::all_of(config.reward.weight, [](double weight) { return weight == 0; })) {
    warnings.emplace_back("every reward weight is 0: the agent learns nothing");
  }
  if (!built_in) {
    const RewardConfig usual;
    for (const Difference& change : Differences(OptionsOf(config.reward), OptionsOf(usual))) {
      if (change.now.name == "reward") continue;
      warnings.push_back(
          Concat(change.now.name, " has no effect, because reward replaces the built-in terms"));
    }
  }
  const Options options = OptionsOf(config);
  const std::string asymmetry =
      options.Get("mirror")->text() == "false" ? RewardAsymmetry(config.Environments()) : "";
  if (!asymmetry.empty()) {
    warnings.push_back(
        Concat("mirror is off, because mirrored states have another reward: ", asymmetry));
  }
  return warnings;
}

TrainingSize SizeOf(const Config& config) {
  constexpr double kFloat = sizeof(float);
  const AgentSize l = config.learner().Size(config.Spec());
  const double replay = kFloat * l.transition * l.capacity;
  const double saved = kFloat * l.saved_arrays * l.parameters;
  // The first checkpoint, without a replay memory, is in memory at the same time as the training.
  return {
      kFloat * (l.arrays * l.parameters + l.batch * l.widest * l.layers) + std::max(saved, replay),
      saved + replay};
}

void CheckMemory(const Config& config, int64_t available, int64_t runs) {
  const double needed = static_cast<double>(runs) * SizeOf(config).memory;
  if (needed <= static_cast<double>(available)) return;
  const AgentSize learner = config.learner().Size(config.Spec());
  std::string what = "a ";
  std::string flags = Concat("--hidden or ", learner.store_flag);
  if (runs > 1) {
    what = Concat(runs, " runs at a time, each with a ");
    flags = Concat("--hidden, ", learner.store_flag, " or --jobs");
  }
  throw BadInput(Concat("train: expected at most ", Gigabytes(static_cast<double>(available)),
                        " of free memory, got ", Gigabytes(needed), " for ", what, "network of ",
                        FormatCount(learner.parameters), " parameters and a ", learner.store,
                        " of ", FormatCount(learner.capacity), " transitions; reduce ", flags));
}

}  // namespace upswing
