#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "core/policy.h"
#include "rl/evaluate.h"
#include "sim/pendulum_env.h"

/// One episode, step by step, as `simulate` writes and `plot` draws it.
namespace upswing {

/// One moment and the torque that acts from then on.
struct RolloutRow {
  double t = 0;  // s
  PendulumState state;
  double torque = 0;  // N·m, what the motor gives: after its delay, within its limit
  double energy = 0;  // J
  double height = 0;  // of the tip, m
  bool inverted = false;
  double reward = 0;  // for the state and the torque, the sum of the terms
  std::array<double, kRewardTerms> terms{};
  std::vector<double> q;  // (A) Q-values of the policy's actions, in units of reward, if asked for
};

struct RolloutConfig {
  const Policy* policy = nullptr;      // who chooses torques; none: the schedule
  std::vector<double> schedule;        // N·m, a torque for each step; 0 behind its end
  PendulumEnvConfig env;               // of one environment
  std::optional<PendulumState> start;  // none: that of the environment's own episode
  double seconds = 20;                 // to the nearest step
  bool q_values = false;
};

struct Rollout {
  std::vector<RolloutRow> rows;  // at 0, 0.02, … s, the last state included
  Plant plant;                   // of this episode
  Disturbance disturbance;       // of this episode
};

/// How many control steps so many seconds are, to the nearest.
int64_t RolloutSteps(double seconds);

/// Throws Failure if the state blows up.
Rollout RunRollout(const RolloutConfig& config);

/// What `eval` says of the environment's own episode.
EvaluationEpisode JudgeEpisode(const Policy& policy, const PendulumEnvConfig& env);

/// The same in words: `success, upright from 2.34 s to the end, return 2345`.
std::string JudgementText(const EvaluationEpisode& episode);

/// What distinguishes an episode from others with the same flags: its plant, `mass1 0.93, …`, and
/// its sensor noise (rad, rad/s) and delay (s) where there are any.
std::string EpisodeText(const Rollout& rollout);

/// Four numbers q1,q2,w1,w2 (rad, rad/s) as --start gives them. Throws BadInput.
PendulumState ParseStart(const std::string& text);

}  // namespace upswing
