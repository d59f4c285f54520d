#pragma once

#include <map>
#include <optional>
#include <string>
#include <vector>

#include "agents/loaded_policy.h"
#include "judge/trial.h"
#include "pendulum/pendulum_env.h"
#include "rl/evaluate.h"

/// Evaluations of a policy over many episodes, and their reports.
namespace upswing {

/// One episode: its conditions and its result.
struct JudgedEpisode {
  PendulumState start;
  std::optional<Pose> goal;  // of a policy for any pose
  Plant plant;
  Disturbance disturbance;
  bool for_its_plant = false;  // had its own controller (TrialArguments::known_plant)
  EvaluationEpisode result;
};

/// A finished evaluation.
struct EvalReport {
  std::string policy;     // path
  PendulumEnvConfig env;  // common settings of all episodes
  std::vector<JudgedEpisode> episodes;
  Evaluation figures;
  bool known_plant = false;    // a controller was designed for the plant of each episode
  bool knows_values = false;   // the policy's file defines the unit of its values
  bool only_balances = false;  // true for a controller that does not swing up
};

/// Evaluates a policy over `episodes` episodes of a trial's environments. With trial.known_plant a
/// controller is designed for each episode's plant; if that fails, the given one is used.
/// `progress` counts episodes. Throws BadInput.
EvalReport EvaluatePolicy(const LoadedPolicy& loaded, const TrialArguments& trial, int64_t episodes,
                          ThreadPool& pool, const Progress& progress);

/// The episodes that begin near one pose and ask for another.
struct TransitionCount {
  int64_t episodes = 0, successes = 0;
};

/// The transitions of a policy for any pose, by name, such as "up-up to up-down".
std::map<std::string, TransitionCount> TransitionsOf(const EvalReport& report);

/// Number of episodes with a controller designed for their plant.
int64_t NumDesigned(const EvalReport& report);

/// The report as a JSON document.
std::string EvalJson(const EvalReport& report);

/// A row for each episode, counted from 0. A missing figure is empty, such as the swing-up time of
/// an episode that is not upright at the end.
std::string EpisodesCsv(const EvalReport& report);

}  // namespace upswing
