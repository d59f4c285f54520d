#include <fmt/format.h>

#include <cmath>
#include <filesystem>
#include <nlohmann/json.hpp>
#include <optional>

#include "agents/config.h"
#include "agents/controllers.h"
#include "agents/loaded_policy.h"
#include "base/error.h"
#include "base/format.h"
#include "base/json.h"
#include "base/simd.h"
#include "base/text.h"
#include "cli/commands.h"
#include "control/lqr_catch.h"
#include "mujoco/model.h"
#include "nn/network_policy.h"
#include "os/command.h"
#include "os/host.h"
#include "pendulum/observation.h"
#include "pendulum/upright_modes.h"
#include "runs/config_files.h"
#include "runs/find_policy.h"
#include "runs/run_folder.h"
#include "runs/tensor_file.h"

namespace upswing {
namespace {

namespace fs = std::filesystem;
using nlohmann::ordered_json;

/// A text from a file on one line; "unknown" if the file lacks it.
std::string Known(const std::string& text) { return text.empty() ? "unknown" : Printable(text); }
std::string Known(std::optional<int64_t> count) {
  return count ? std::to_string(*count) : "unknown";
}

/// The observation of a double pendulum policy.
std::string ObservationText(const LoadedPolicy& loaded) {
  std::string text = fmt::format("{} numbers for the motion", kObservationSize);
  if (loaded.identifies()) {
    text += fmt::format(", {} for the identified plant", kIdentifiedSize);
  }
  if (loaded.seeks_any_pose()) text += fmt::format(", {} for the goal", kGoalSize);
  const int steps = loaded.memory();
  if (steps == 1) text += fmt::format(", {} for the last step", kMemorySize);
  if (steps > 1) text += fmt::format(", {} for each of the last {} steps", kMemorySize, steps);
  return text;
}

/// The result of the evaluation at which the policy was the best.
std::string EvaluationText(const PolicyInfo& info) {
  if (!info.success_rate || !info.mean_return) return "unknown";
  // Without a return that counts as success, every episode of a foreign task fails.
  if (IsForeign(info.task)) return fmt::format("mean return {:.4g}", *info.mean_return);
  return fmt::format("success {:.0f}%, mean return {:.0f}", 100 * *info.success_rate,
                     *info.mean_return);
}

void PrintSelfCheck(const SelfCheck& check) {
  fmt::print("  self-check  passed, largest difference {:.1e} (allowed {:.1e})\n", check.error,
             check.tolerance);
  if (check.has_checksum) {
    fmt::print("  checksum    correct\n");
    return;
  }
  fmt::print(
      "  checksum    none: a changed weight goes unnoticed if it moves no output of the "
      "samples\n"
      "              by more than allowed\n");
}

/// Prints a controller, which has neither a file nor a training.
void PrintController(const LoadedPolicy& loaded) {
  const Policy& policy = *loaded.policy;
  fmt::print("{}\n", Printable(loaded.name));
  fmt::print("  what        {}\n", policy.description());
  fmt::print("  torques     up to ±{} N·m, every {} s\n", loaded.plant.torque_limit,
             *policy.info().control_period);
  fmt::print("  plant       {}\n", PlantText(loaded.plant));
  const UprightModes modes = ModesOf(loaded.plant);
  fmt::print(
      "  modes       unstable upright, grow at {:.3g}/s and {:.3g}/s (ratio {:.3g}), delta "
      "{:.2f}\n",
      modes.faster, modes.slower, modes.slower / modes.faster, modes.delta);
  if (const auto* regulator = dynamic_cast<const LqrPolicy*>(&policy)) {
    fmt::print("  region      of attraction, by simulation: x'Px < {:.4g}\n",
               RegionOfAttraction(regulator->lqr(), loaded.design_plant()));
  }
}

/// Prints the actions that a policy may choose. `learned` is the policy, if it is a network's.
void PrintActions(const LoadedPolicy& loaded, const NetworkPolicy* learned) {
  std::span<const double> levels;
  std::span<const double> limits;
  if (learned != nullptr) {
    levels = learned->parts().torques;
    limits = learned->parts().action_limit;
  }
  if (loaded.is_foreign()) {
    if (levels.empty()) {
      fmt::print("  actions     within ±{}\n", fmt::join(limits, ", ±"));
    } else {
      fmt::print("  actions     one of {}\n", fmt::join(levels, ", "));
    }
    return;
  }
  std::string torques = "any within the torque limit";
  if (!levels.empty()) torques = fmt::format("{} N·m", fmt::join(levels, ", "));
  fmt::print("  torques     {}, every {} s\n", torques, FormatNumber(loaded.control_period()));
}

void PrintPolicy(const LoadedPolicy& loaded) {
  const Policy& policy = *loaded.policy;
  const PolicyInfo& info = policy.info();
  fmt::print("{}\n", Printable(loaded.name));
  fmt::print("  what        {}, {} parameters\n", policy.description(),
             FormatCount(policy.num_parameters()));
  if (loaded.is_foreign()) fmt::print("  task        {}\n", loaded.task);
  const auto* learned = dynamic_cast<const NetworkPolicy*>(&policy);
  PrintActions(loaded, learned);
  fmt::print("  made by     agent {}, seed {}, step {}, upswing {}\n", Known(info.agent),
             Known(info.seed), Known(info.step), Known(info.upswing_version));
  fmt::print("  evaluated   {}\n", EvaluationText(info));
  if (!loaded.is_foreign()) {
    fmt::print("  observes    {}\n", ObservationText(loaded));
    fmt::print("  plant       {}\n", PlantText(loaded.plant));
  }
  if (learned != nullptr) PrintSelfCheck(learned->self_check());
}

/// The settings of a run and the state in its checkpoint.
struct RunFacts {
  explicit RunFacts(const fs::path& path)
      : checkpoint(LoadTensors(path / RunFolder::kCheckpoint)),
        config(ReadRunConfig(path)),
        spec(config.Spec()),
        state(spec.num_envs, static_cast<int>(spec.term_names.size())) {
    state.State(Archive::Loader(checkpoint).In("train"));
  }
  Tensors checkpoint;
  Config config;
  EnvSpec spec;
  TrainState state;
};

ordered_json RunJson(const fs::path& path) {
  const RunFacts run(path);
  const TrainState& state = run.state;
  return {{"run", path.string()},
          {"agent", run.config.agent},
          {"seed", run.config.train.seed},
          {"step", state.steps},
          {"steps", run.config.train.steps},
          {"episodes", state.episodes},
          {"seconds", state.seconds},
          {"solved", state.solved},
          {"solve_step", state.solved ? ordered_json(state.streak_step) : nullptr},
          {"solve_seconds", state.solved ? ordered_json(state.streak_seconds) : nullptr},
          {"best_step", state.best_step}};
}

void PrintRun(const fs::path& path, bool has_policy) {
  const RunFacts run(path);
  const Config& config = run.config;
  const TrainState& state = run.state;
  fmt::print("{}\n", Printable(path.string()));
  fmt::print("  agent       {}, seed {}, upswing {}\n", config.agent, config.train.seed,
             Printable(run.checkpoint.Metadata("upswing_version")));
  fmt::print("  checkpoint  step {} of {}, {} episodes, {} of training\n", FormatCount(state.steps),
             FormatCount(config.train.steps), FormatCount(state.episodes),
             FormatDuration(state.seconds));
  if (std::isinf(run.spec.evaluation.solved_return)) {
    fmt::print("  task        {}, never solved, as no solved_return was given\n", run.spec.task);
  } else if (state.solved) {
    fmt::print("  solved      at step {}, after {} of training\n", FormatCount(state.streak_step),
               FormatDuration(state.streak_seconds));
  } else {
    fmt::print("  solved      not yet; last success rate {}\n", state.last_success_rate);
  }
  if (has_policy) return;
  if (state.best_step == 0) {
    fmt::print("  policy      none yet; the first evaluation writes one\n");
  } else {
    fmt::print("  policy      the best one, from step {}, no longer exists\n",
               FormatCount(state.best_step));
  }
}

/// A policy as JSON; null where its file says nothing.
ordered_json PolicyJson(const LoadedPolicy& loaded) {
  const Policy& policy = *loaded.policy;
  const PolicyInfo& info = policy.info();
  const auto known = [](const auto& value) { return value ? ordered_json(*value) : nullptr; };
  ordered_json j{{"policy", loaded.name},
                 {"description", policy.description()},
                 {"parameters", policy.num_parameters()},
                 {"task", loaded.task},
                 {"agent", info.agent},
                 {"seed", known(info.seed)},
                 {"step", known(info.step)},
                 {"upswing_version", info.upswing_version},
                 {"success_rate", known(info.success_rate)},
                 {"mean_return", known(info.mean_return)},
                 {"control_period", known(info.control_period)}};
  if (!loaded.is_foreign()) {
    j["memory"] = loaded.memory();
    j["identifies"] = loaded.identifies();
    j["any_pose"] = loaded.seeks_any_pose();
    for (const auto& [name, value] : PlantValues(loaded.plant)) j["plant"][name] = value;
  }
  if (const auto* learned = dynamic_cast<const NetworkPolicy*>(&policy)) {
    const SelfCheck check = learned->self_check();
    j["self_check"] = {
        {"error", check.error}, {"tolerance", check.tolerance}, {"checksum", check.has_checksum}};
  }
  return j;
}

/// Prints the program's version, and the libraries and hardware that it uses on this machine.
void PrintProgram() {
  fmt::print("upswing {}\n", UPSWING_VERSION);
  fmt::print("  physics     MuJoCo {}\n", MuJoCoVersion());
  fmt::print("  threads     {} by default\n", ResolveThreads(0));
  fmt::print("  vectors     {} (this processor supports: {})\n", SimdPath(),
             fmt::join(SimdPaths(), ", "));
  fmt::print("  policies    {} (shipped)\n", fmt::join(ShippedPolicies(), ", "));
  if (!IsInstalled()) return;
  fmt::print("  examples    {}\n", Printable((SharePath() / "examples").string()));
}

ordered_json ProgramJson() {
  return {{"upswing", UPSWING_VERSION},       {"mujoco", MuJoCoVersion()},
          {"threads", ResolveThreads(0)},     {"vectors", SimdPath()},
          {"supported_vectors", SimdPaths()}, {"policies", ShippedPolicies()},
          {"controllers", ControllerNames()}};
}

/// The arguments of `info`.
struct InfoArguments : PolicyArguments {
  bool as_json = false;
};

/// The program, a policy, or a run and its policy, as JSON.
ordered_json InfoJson(const InfoArguments& a) {
  if (a.empty()) return ProgramJson();
  const fs::path path = a.name;
  if (!fs::exists(path / RunFolder::kConfig)) return PolicyJson(GetPolicy(a));
  ordered_json j = RunJson(path);
  j["policy"] = fs::exists(path / RunFolder::kPolicy) ? PolicyJson(GetPolicy(a)) : nullptr;
  return j;
}

int RunInfo(const InfoArguments& a) {
  if (a.as_json) {
    fmt::print("{}\n", PrintableJson(InfoJson(a)));
    return 0;
  }
  if (a.empty()) {
    PrintProgram();
    return 0;
  }
  if (IsController(a.name) || a.has_settings()) {
    PrintController(GetPolicy(a));
    return 0;
  }
  const std::string& path = a.name;
  const bool is_run = fs::exists(fs::path(path) / RunFolder::kConfig);
  const fs::path run_policy = fs::path(path) / RunFolder::kPolicy;
  try {
    if (is_run) PrintRun(path, fs::exists(run_policy));
  } catch (const Error& error) {
    if (!fs::exists(run_policy)) throw;
    throw Error(
        error.exit_code(),
        Concat(error.what(), " (its policy is a separate file: ", run_policy.string(), ")"));
  }
  if (!is_run || fs::exists(run_policy)) PrintPolicy(GetPolicy(a));
  return 0;
}

}  // namespace

void AddInfo(CommandLine& line) {
  InfoArguments& a = line.Runs(RunInfo);
  AddPolicy(line, a);
  line.Flag("--json", a.as_json, "print JSON instead of text");
  line.Examples(
      "  ./upswing info runs/d3qn-seed1\n"
      "  ./upswing info policy.safetensors\n"
      "  ./upswing info lqr --made-for mass2=1.2\n"
      "  ./upswing info               threads and vector instructions on this machine\n");
}

}  // namespace upswing
