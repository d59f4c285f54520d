#include <fmt/format.h>

#include <memory>
#include <nlohmann/json.hpp>
#include <optional>

#include "apps/commands.h"
#include "apps/config.h"
#include "apps/loaded_policy.h"
#include "apps/model_info.h"
#include "apps/progress.h"
#include "core/error.h"
#include "core/text.h"
#include "core/thread_pool.h"
#include "rl/evaluate.h"

namespace upswing {
namespace {

struct EvalArguments {
  std::string policy, model, physics;
  std::vector<std::string> set;
  int64_t episodes, threads, seed;
  bool as_json = false;
  std::vector<FlagValue> flags;
};

/// What an evaluation may try a policy with, besides another plant.
struct Trial {
  Disturbance disturbance;
  Randomization randomization;

  void Describe(Options& o) {
    disturbance.Describe(o);
    randomization.Describe(o);
  }
};

/// Throws BadInput.
Trial TrialOf(const std::vector<FlagValue>& flags) {
  Trial trial;
  SetFlags(OptionsOf(trial), flags);
  return trial;
}

/// The settings that are not at their default, as text: `delay 0.02, …`; empty if there are none.
std::string ChangesText(Trial trial) {
  Trial defaults;
  const Options options = OptionsOf(trial), usual = OptionsOf(defaults);
  std::vector<std::string> texts;
  for (size_t k = 0; k < options.all().size(); ++k) {
    const Option& option = options.all()[k];
    if (option.text() == usual.all()[k].text()) continue;
    texts.push_back(Concat(option.name, " ", option.text()));
  }
  return Join(texts, ", ");
}

void PrintTable(const Evaluation& e, const LoadedPolicy& loaded, const EvalArguments& arguments,
                const Plant& plant, const std::optional<ModelInfo>& model, const Trial& trial) {
  const auto moments = [](const Moments& m) {
    return fmt::format("{:.4g} ± {:.2g}", m.mean, m.deviation);
  };
  fmt::print("{}\n", Printable(loaded.path.string()));
  fmt::print("  plant          {}, physics {}\n", PlantText(plant), arguments.physics);
  if (model) fmt::print("  {:<15}{}\n", "model", model->Text());
  const std::string changes = ChangesText(trial);
  if (!changes.empty()) fmt::print("  {:<15}{}\n", "with", changes);
  fmt::print("  success        {} of {} = {:.1f}%   (95% interval {:.1f}% to {:.1f}%)\n",
             e.successes, e.episodes, 100 * e.success_rate(), 100 * e.success_interval.low,
             100 * e.success_interval.high);
  if (e.successes > 0) {
    fmt::print("  swing-up time  {:.2f} s   (middle half {:.2f} to {:.2f} s)\n",
               e.swing_up_seconds.median, e.swing_up_seconds.low, e.swing_up_seconds.high);
  } else {
    fmt::print("  swing-up time  none swung up to stay\n");
  }
  fmt::print("  return         {}   in the first {} s\n", moments(e.reward_sum), kReturnSeconds);
  for (size_t k = 0; k < e.term_means.size(); ++k) {
    fmt::print("    {:<18}{:8.2f}\n", kRewardTermNames[k], e.term_means[k]);
  }
  fmt::print("  energy used    {} J   in {} s\n", moments(e.work), kEvaluationSeconds);
  fmt::print("  torque         peak {:.4g} N·m, rms {} N·m\n", e.peak_torque,
             moments(e.rms_torque));
}

void PrintJson(const Evaluation& e, const LoadedPolicy& loaded, const EvalArguments& arguments,
               const Plant& plant, const std::optional<ModelInfo>& model, Trial trial) {
  using nlohmann::ordered_json;
  ordered_json j;
  j["policy"] = loaded.path.string();
  j["seed"] = arguments.seed;
  j["physics"] = arguments.physics;
  for (const auto& [name, value] : PlantValues(plant)) j["plant"][name] = value;
  j["model"] = model ? model->Json() : kBuiltIn;
  const Options options = OptionsOf(trial);
  for (const Option& option : options.all()) {
    j[option.section][option.name] = *std::get<double*>(option.target);
  }
  j["episodes"] = e.episodes;
  j["successes"] = e.successes;
  j["success_rate"] = e.success_rate();
  j["success_interval_95"] = {e.success_interval.low, e.success_interval.high};
  if (e.successes > 0) {
    j["swing_up_seconds"] = {{"median", e.swing_up_seconds.median},
                             {"quartiles", {e.swing_up_seconds.low, e.swing_up_seconds.high}}};
  } else {
    j["swing_up_seconds"] = nullptr;
  }
  const auto moments = [](const Moments& m) -> ordered_json {
    return {{"mean", m.mean}, {"deviation", m.deviation}};
  };
  j["return"] = moments(e.reward_sum);
  for (size_t k = 0; k < e.term_means.size(); ++k) {
    j["reward_terms"][kRewardTermNames[k]] = e.term_means[k];
  }
  j["energy_used"] = moments(e.work);
  j["peak_torque"] = e.peak_torque;
  j["rms_torque"] = moments(e.rms_torque);
  fmt::print("{}\n", j.dump(2, ' ', true, ordered_json::error_handler_t::replace));
}

int RunEval(const EvalArguments& arguments) {
  PendulumEnvConfig config;
  config.physics = ParsePhysics(arguments.physics, "--physics");
  const Trial trial = TrialOf(arguments.flags);
  const LoadedPolicy loaded = LoadPolicy(arguments.policy);
  config.mjcf = loaded.mjcf;
  config.memory = loaded.memory();
  const Plant plant = ChangedPlant(loaded.plant, arguments.model, arguments.set, config.mjcf);
  const std::optional<ModelInfo> model = InfoOfModel(config.mjcf, arguments.model);
  config.plants = {plant};
  config.disturbances = {trial.disturbance};
  config.randomization = trial.randomization;
  config.num_envs = static_cast<int>(arguments.episodes);
  config.episode_seconds = kEvaluationSeconds;
  config.seed = static_cast<uint64_t>(arguments.seed);
  config.stream = "evaluation";
  ThreadPool pool(ResolveThreads(arguments.threads));
  config.pool = &pool;
  PendulumEnv env(config);

  Evaluation evaluation;
  {
    EpisodeProgress progress(static_cast<double>(arguments.episodes), arguments.as_json);
    evaluation = Evaluate(loaded.policy, env, &pool, [&](double share) { progress.Show(share); });
  }
  if (arguments.as_json) {
    PrintJson(evaluation, loaded, arguments, plant, model, trial);
  } else {
    PrintTable(evaluation, loaded, arguments, plant, model, trial);
  }
  return 0;
}

}  // namespace

void AddEval(CLI::App& program, Command& command) {
  CLI::App* app = program.add_subcommand("eval", "Judge a policy over many episodes");
  auto a = std::make_shared<EvalArguments>();
  AddPolicy(*app, a->policy)->required();
  Options own;
  own.Add(&a->episodes, "episodes", 100, {1, 1000000}, "", "how many");
  AddArguments(*app, own);
  AddSeed(*app, a->seed, "the start states");
  AddPlantOptions(*app, a->set, a->model);
  AddPhysics(*app, a->physics, "mujoco");
  Trial defaults;
  AddSettings(*app, OptionsOf(defaults), a->flags);
  AddThreads(*app, a->threads);
  app->add_flag("--json", a->as_json, "print JSON instead of a table")->disable_flag_override();
  app->footer(fmt::format(
      "An episode lasts {} s from hanging with normal noise of 0.1 (rad, rad/s). It succeeds if "
      "both\nlinks are within 30° of upright for the whole of the last {} s. The return is the "
      "undiscounted\nsum of the reward, standard weights, over the first {} s.\n\n"
      "Examples:\n"
      "  ./upswing eval runs/d3qn-seed1\n"
      "  ./upswing eval policy.safetensors --episodes 1000 --seed 7 --json\n"
      "  ./upswing eval runs/d3qn-seed1 --set mass2=1.05 --set gravity=9.7\n"
      "  ./upswing eval runs/d3qn-seed1 --randomize 0.25 --episodes 1000   share of a box of "
      "plants\n"
      "  ./upswing eval runs/d3qn-seed1 --sensor-noise 0.02 --delay 0.02\n\n"
      "--set takes mass1, mass2, length1, length2, damping1, damping2, gravity, torque_limit, and\n"
      "mass, length, damping for both. With --randomize each episode has its own plant, drawn from "
      "a\nbox around that one.\n",
      kEvaluationSeconds, kHoldSeconds, kReturnSeconds));
  app->callback([a, &command] { command = [a] { return RunEval(*a); }; });
}

}  // namespace upswing
