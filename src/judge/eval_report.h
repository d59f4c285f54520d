#pragma once

#include <map>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "agents/loaded_policy.h"
#include "judge/trial.h"
#include "pendulum/pendulum_env.h"
#include "report/statistics.h"
#include "rl/train/evaluate.h"
#include "runs/find_policy.h"

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
  std::string title;      // ShortTitle
  PendulumEnvConfig env;  // common settings of all episodes
  std::vector<JudgedEpisode> episodes;
  Evaluation figures;
  std::string left_out = {};   // defaults that the plant file left to the program (PlantFile)
  bool known_plant = false;    // a controller was designed for the plant of each episode
  bool knows_values = false;   // the policy's file defines the unit of its values
  bool only_balances = false;  // true for a controller that does not swing up
};

/// The evaluation of a policy over `episodes` episodes of a trial's environments, before it runs.
/// Throws BadInput.
EvalReport PlanEvaluation(const LoadedPolicy& loaded, const TrialArguments& trial,
                          int64_t episodes);

/// Throws BadInput unless all planned evaluations have the same episodes: their plants and goals.
void CheckSameEpisodes(std::span<const EvalReport> reports);

/// Runs a planned evaluation of this policy. With known_plant a controller is designed for each
/// episode's plant; if that fails, the given one is used. `progress` counts episodes.
void RunEvaluation(EvalReport& report, const LoadedPolicy& loaded, ThreadPool& pool,
                   const Progress& progress);

/// PlanEvaluation, then RunEvaluation.
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

/// A figure of one policy minus that of another, over the episodes in which both have it.
struct PairedFigure {
  std::string name;  // as in EvalJson
  int64_t episodes = 0;
  Estimate difference = {};  // mean of the differences, with the interval of pairs
};

/// The figures of a report minus those of another with the same episodes: the success rate, then
/// every figure but the values, whose unit may differ.
std::vector<PairedFigure> PairedFigures(const EvalReport& report, const EvalReport& other);

/// The report as a JSON document.
std::string EvalJson(const EvalReport& report);
/// Reports with the same episodes as a list of these documents, with the differences of each to the
/// first and the controllers that could not be designed.
std::string ComparisonJson(std::span<const EvalReport> reports,
                           std::span<const Undesigned> undesigned);

/// A row for each episode, counted from 0. A missing figure is empty, such as the swing-up time of
/// an episode that fails. If the reports are `compared`, the policy is in the first column.
std::string EpisodesCsv(std::span<const EvalReport> reports, bool compared);

}  // namespace upswing
