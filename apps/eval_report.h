#pragma once

#include <optional>
#include <string>
#include <vector>

#include "lab/config.h"
#include "lab/model_info.h"
#include "rl/evaluate.h"
#include "sim/pendulum_env.h"

/// What `eval` says of its episodes.
namespace upswing {

/// One episode: its conditions and its result.
struct JudgedEpisode {
  std::vector<double> start;  // (S)
  // Of the double pendulum:
  Plant plant;
  Disturbance disturbance;
  EvaluationEpisode result;
};

/// A finished evaluation.
struct EvalReport {
  std::string policy;              // path
  std::string physics;             // name of the engine
  std::optional<ModelInfo> model;  // none: the built-in one
  EnvConfig env;                   // what all episodes have in common
  EnvSpec spec;
  std::vector<JudgedEpisode> episodes;
  Evaluation figures;
  bool knows_values = false;  // the policy says what its Q-values estimate
};

/// Print the report on standard output, for people and for programs.
void PrintEvalTable(const EvalReport& report);
void PrintEvalJson(const EvalReport& report);

/// A row for each episode, counted from 0; a figure that it does not have (such as the swing-up
/// time of one that is not upright at the end) is empty.
std::string EpisodesCsv(const EvalReport& report);

}  // namespace upswing
