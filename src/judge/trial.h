#pragma once

#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>

#include "agents/config.h"
#include "agents/loaded_policy.h"
#include "judge/rollout.h"
#include "pendulum/pendulum_env.h"

/// The plant, sensors and motor for `eval`, `simulate` and `plot`. The same flags make the same
/// episodes in all of them.
namespace upswing {

/// Differences of a trial from the training.
struct TrialArguments {
  std::string physics = "mujoco";
  std::string plant;  // name of a plant file or a shipped plant; empty: the policy's
  std::vector<std::string> set;
  std::vector<FlagValue> plant_flags;  // settings of Plant, which `set` changes further
  std::vector<FlagValue> flags;        // settings of Disturbance and Randomization
  int64_t seed = 0;
  bool unknown_plant = false;
  bool known_plant = false;   // design a controller for each episode's plant; only in eval
  double control_period = 0;  // s; 0: the policy's, or that of the size of the plant
  std::string goal;  // name of the pose to reach; empty: upright, or in eval one for each episode
  // The single episode of `simulate`, `plot` and `view`: its start (empty: hanging), or its index
  // in `eval` (negative: none).
  std::string start;
  int64_t episode = -1;

  bool is_of_eval() const { return episode >= 0; }
};

/// The plant of a loaded policy in the trial, by file and flags. Throws BadInput.
Plant PlantIn(const TrialArguments& trial, const LoadedPolicy& loaded);
/// A loaded policy for the plant of the trial (PlantIn, ForOtherSize). Throws as they do.
LoadedPolicy UsedIn(const TrialArguments& trial, const LoadedPolicy& loaded);

/// Disturbances of sensors and motor, and random plants.
struct TrialConditions {
  Disturbance disturbance;
  Randomization randomization;

  void Describe(Options& o) {
    disturbance.Describe(o);
    randomization.Describe(o);
  }
};

/// The conditions that flags set, later ones over earlier ones. Throws BadInput.
TrialConditions ConditionsOf(const std::vector<FlagValue>& flags);

/// The environments of a trial: the environments of the policy's training with the changes of the
/// arguments; without a policy (null), environments of the built-in plant. Environment i has
/// episode i. If the arguments name no goal, it is upright; or, if `draws_goals` as in
/// `eval`, each episode of a learned policy draws its own. Throws BadInput, also if the policy
/// is not for the double pendulum.
PendulumEnvConfig TrialEnvironments(const TrialArguments& a, const LoadedPolicy* loaded,
                                    bool draws_goals = false);

/// What an episode is to reach, for messages: "upright", or "at the goal" of a policy for any pose.
inline const char* Reached(bool any_pose) { return any_pose ? "at the goal" : "upright"; }

/// An environment whose only episode is episode `index` of `config`.
PendulumEnv OneEpisode(PendulumEnvConfig config, int index);

/// Conditions that differ from the defaults, such as `delay 0.02, …`; empty if there are none.
std::string ChangesText(const PendulumEnvConfig& env);

/// The folder for figures of a policy: `out`; if that is empty, NAME in the run folder,
/// runs/NAME-FILE for another policy file or runs/NAME-CONTROLLER for a controller, with -2, -3, …
/// if the folder exists. Throws BadInput if `out` is not empty or has the name of a figure.
std::filesystem::path FigureFolder(const std::string& out, const LoadedPolicy& loaded,
                                   const std::string& name);

/// The single episode of the arguments, with a policy (null: none) that must outlive it. Throws
/// BadInput.
RolloutConfig TrialEpisode(const TrialArguments& a, const LoadedPolicy* loaded);

}  // namespace upswing
