#pragma once

#include <array>
#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "agents/task.h"
#include "base/policy.h"
#include "base/sample.h"
#include "rl/evaluate.h"

/// Rollouts: one episode, step by step, that `simulate` writes and `plot` draws.
namespace upswing {

/// One moment and the torque that acts from this moment on.
struct RolloutRow {
  double t = 0;               // s
  std::vector<double> state;  // (S)
  double torque = 0;          // applied by the motor, delayed and limited; N·m or the task's unit
  // Double pendulum: for the state and torque of this row. Other tasks: for the step that begins
  // here.
  bool at_goal = false;
  double reward = 0;          // sum of the terms
  std::vector<double> terms;  // (K)
  // Only if requested, and if the policy estimates them:
  std::vector<double> q;           // (Q) values of the actions, or only V, in units of reward
  std::optional<Interval> spread;  // central 68% of the torques that the policy would draw
  double chosen = 0;               // chosen torque, before delay and limit
};

struct RolloutConfig {
  const Policy* policy = nullptr;            // chooses the torques; none: the schedule
  std::vector<double> schedule;              // one torque per step; 0 after its end
  EnvConfig env;                             // a single environment
  std::optional<std::vector<double>> start;  // (S); none: that of the environment's own episode
  double seconds = 20;                       // (S); none: the environment's own start
  bool estimates = false;  // whether rows have the policy's estimates q and spread
  std::string title;       // for figures
};

struct Rollout {
  EnvSpec spec;
  // One row per control step. The double pendulum has one more row, for its last state; other tasks
  // end with the last step.
  std::vector<RolloutRow> rows;
  // Only for the double pendulum, of this episode:
  Plant plant;
  Disturbance disturbance;
};

/// An episode that advances step by step, for RunRollout and `view`.
class Episode {
 public:
  /// The policy must outlive the episode. Throws BadInput as MakeEnv does.
  explicit Episode(RolloutConfig config);

  /// Adds a row with the present state, then steps the environment. Without `motor` the torque is 0
  /// instead of the policy's or schedule's. `push` (N·m) adds a torque to each joint of a double
  /// pendulum. Throws Failure if the state blows up, or if the physics does not support pushes.
  void Step(bool motor = true, const std::array<double, 2>& push = {});
  /// Goes back to the state after the first `steps` steps.
  void GoBack(int64_t steps);

  const RolloutConfig& config() const { return config_; }
  /// The rollout up to the last step.
  const Rollout& rollout() const { return rollout_; }
  int64_t steps() const { return static_cast<int64_t>(rollout_.rows.size()); }
  /// Whether the last step ended the episode; the environment is then in a new episode.
  bool done() const { return result_.done(0); }
  /// The environment as a double pendulum; null for other tasks.
  PendulumEnv* pendulum() const { return dynamic_cast<PendulumEnv*>(env_.get()); }

  /// The double pendulum's state after `steps` steps, at most steps(), fractions included. Between
  /// two steps it follows the cubic that matches their angles and velocities.
  PendulumState StateAt(double steps) const;
  /// The motor's torque after `steps` steps, N·m.
  double TorqueAt(double steps) const;

 private:
  /// Inputs of one step.
  struct Input {
    bool motor;
    std::array<double, 2> push;
  };
  PendulumState StateOfRow(int64_t k) const;

  RolloutConfig config_;
  std::unique_ptr<VectorEnv> env_;
  StepResult result_;
  std::unique_ptr<Policy::Memory> memory_;
  Rollout rollout_;
  std::vector<Input> inputs_;  // one per step
};

/// Number of control steps in `seconds`, rounded to the nearest.
int64_t RolloutSteps(const EnvSpec& spec, double seconds);

/// Runs an episode to its end. Throws Failure if the state blows up.
Rollout RunRollout(const RolloutConfig& config);

/// The motor's torques over a rollout, with the figures that `eval` computes for an episode:
/// `peak 5 N·m, rms 1.2 N·m, variation 34 N·m/s, once upright 2 N·m/s`.
std::string TorqueText(const Rollout& rollout);

/// A rollout as CSV, one row for each state: t, state, torque, reward and its terms. The double
/// pendulum also has energy, height and whether it is inverted, before the reward.
std::string RolloutCsv(const Rollout& rollout);

/// The double pendulum's state in a row.
PendulumState StateOf(const RolloutRow& row);

/// The judgement of `eval` on the environment's own episode, such as `success, upright from 2.34 s
/// to the end, return 2345`.
std::string JudgementText(const Policy& policy, const EnvConfig& config);

/// The conditions that distinguish an episode from others with the same flags: its plant, `mass1
/// 0.93, …`, and the disturbance settings that are not 0. Empty for other tasks.
std::string EpisodeText(const Rollout& rollout);

}  // namespace upswing
