#pragma once

#include <array>
#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "core/policy.h"
#include "core/sample.h"
#include "rl/evaluate.h"
#include "setup/task.h"

/// One episode, step by step, as `simulate` writes and `plot` draws it.
namespace upswing {

/// One moment and the torque that acts from then on.
struct RolloutRow {
  double t = 0;               // s
  std::vector<double> state;  // (S)
  double torque = 0;          // what the motor gives: after its delay, within its limit; N·m
                              // or the task's unit of actions
  // Of the double pendulum for the state and the torque of this row, of other tasks for the step
  // that begins here.
  bool at_goal = false;
  double reward = 0;          // the sum of the terms
  std::vector<double> terms;  // (K)
  // If asked for, and if the policy has them:
  std::vector<double> q;           // (Q) values of its actions, or V alone, in units of reward
  std::optional<Interval> spread;  // the central 68% of the torques that it learned to draw
  double chosen = 0;               // the torque that was chosen, before delay and limit
};

struct RolloutConfig {
  const Policy* policy = nullptr;            // who chooses torques; none: the schedule
  std::vector<double> schedule;              // a torque for each step; 0 behind its end
  EnvConfig env;                             // of one environment
  std::optional<std::vector<double>> start;  // (S); none: that of the environment's own episode
  double seconds = 20;                       // to the nearest step; less if it terminates
  bool estimates = false;  // whether rows have what the policy estimates: q and spread
  std::string title;       // what a picture calls it
};

struct Rollout {
  EnvSpec spec;
  // At each control step; of the double pendulum the last state included, of other tasks up to the
  // last step.
  std::vector<RolloutRow> rows;
  // Of this episode of the double pendulum:
  Plant plant;
  Disturbance disturbance;
};

/// An episode in the making, for RunRollout and for `view`.
class Episode {
 public:
  /// The policy must outlive it. Throws BadInput as MakeEnv does.
  explicit Episode(RolloutConfig config);

  /// Adds the row of the present state, with which the environment steps on. Without `motor` the
  /// torque is 0 instead of what policy or schedule choose; `push` (N·m) turns the joints of a
  /// double pendulum. Throws Failure if its state blows up, or if its physics know no push.
  void Step(bool motor = true, const std::array<double, 2>& push = {});
  /// Goes back to the state after so many of these steps.
  void GoBack(int64_t steps);

  const RolloutConfig& config() const { return config_; }
  /// Everything up to the last step.
  const Rollout& rollout() const { return rollout_; }
  int64_t steps() const { return static_cast<int64_t>(rollout_.rows.size()); }
  /// Whether the last step ended it; the environment is then in another one.
  bool done() const { return result_.done(0); }
  /// Of the double pendulum; null for other tasks.
  PendulumEnv* pendulum() const { return dynamic_cast<PendulumEnv*>(env_.get()); }

  /// The double pendulum's state after so many steps, at most steps(), with a fraction: between two
  /// of them along the cubic that has their angles and velocities.
  PendulumState StateAt(double steps) const;
  /// The motor's torque then, N·m.
  double TorqueAt(double steps) const;

 private:
  /// What a step was made with.
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
  std::vector<Input> inputs_;  // of each step
};

/// How many control steps so many seconds are, to the nearest.
int64_t RolloutSteps(const EnvSpec& spec, double seconds);

/// Throws Failure if the state blows up.
Rollout RunRollout(const RolloutConfig& config);

/// The motor's torques over a rollout, as `eval` has them of an episode:
/// `peak 5 N·m, rms 1.2 N·m, variation 34 N·m/s, once upright 2 N·m/s`.
std::string TorqueText(const Rollout& rollout);

/// A table with a row for each state: t, state, torque, for the double pendulum energy, height and
/// whether it is inverted, reward and its terms.
std::string RolloutCsv(const Rollout& rollout);

/// The double pendulum's state in a row.
PendulumState StateOf(const RolloutRow& row);

/// What `eval` says of the environment's own episode, such as
/// `success, upright from 2.34 s to the end, return 2345`.
std::string JudgementText(const Policy& policy, const EnvConfig& config);

/// What distinguishes an episode from others with the same flags: its plant, `mass1 0.93, …`, and
/// the settings of its disturbance that are not 0; empty for other tasks.
std::string EpisodeText(const Rollout& rollout);

}  // namespace upswing
