#pragma once

#include <cstdint>
#include <filesystem>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "judge/rollout.h"
#include "setup/config.h"
#include "setup/loaded_policy.h"
#include "sim/pendulum_env.h"

/// The plant, sensors and motor on which `eval`, `simulate` and `plot` try a policy out. With
/// the same flags they make the same episodes.
namespace upswing {

/// How a trial differs from the training.
struct TrialArguments {
  std::string model, physics = "mujoco";
  std::vector<std::string> set;
  std::vector<FlagValue> flags;  // of the disturbance and of what is random
  int64_t seed = 0;
  bool unknown_plant = false;
  bool known_plant = false;  // a controller is made anew for each episode's plant; eval alone
  // The single episode of `simulate`, `plot` and `view`: its start, or its number in `eval`
  // (negative: it is none of those).
  std::optional<std::string> start;
  int64_t episode = -1;

  bool is_of_eval() const { return episode >= 0; }
};

/// Sensors, motors and what is random.
struct TrialConditions {
  Disturbance disturbance;
  Randomization randomization;

  void Describe(Options& o) {
    disturbance.Describe(o);
    randomization.Describe(o);
  }
};

/// Those of the arguments. Throws BadInput.
TrialConditions ConditionsOf(const TrialArguments& a);

/// The environments that the arguments ask for: those of the policy's training with the given
/// changes; without a policy (null) those of the built-in plant. Environment i has episode i.
/// Throws BadInput.
EnvConfig TrialEnvironments(const TrialArguments& a, const LoadedPolicy* loaded);

/// The environment whose one episode is number `index` of those of `config`.
std::unique_ptr<VectorEnv> OneEpisode(EnvConfig config, int index);

/// What is not at its default, as text: `delay 0.02, …`; empty if nothing is.
std::string ChangesText(const EnvConfig& env);

/// How a plant differs from what a policy was made for: `mass2 1.3 kg (training: 1), …`; empty: not
/// at all.
std::string PlantChangesText(const Plant& plant, const LoadedPolicy& loaded);

/// The folder that figures of a policy go to: `out` or, where that is empty, this name in its run's
/// folder, runs/NAME-FILE for a policy file elsewhere, runs/NAME-CONTROLLER for a controller; with
/// -2, -3, … where that is taken. Throws BadInput if something is in it, or if it is called as a
/// figure is.
std::filesystem::path FigureFolder(const std::string& out, const LoadedPolicy& loaded,
                                   const std::string& name);

/// The single episode that the arguments ask for, of a policy (null: none) that must outlive it.
/// Throws BadInput.
RolloutConfig TrialEpisode(const TrialArguments& a, const LoadedPolicy* loaded);

}  // namespace upswing
