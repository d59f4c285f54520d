#pragma once

#include <array>
#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "base/policy.h"
#include "base/sample.h"
#include "pendulum/pendulum_env.h"

/// Rollouts: one episode, step by step, that `simulate` writes and `plot` draws.
namespace upswing {

/// One moment and the torque that acts from this moment on.
struct RolloutRow {
  double t = 0;  // s
  PendulumState state;
  double torque = 0;      // applied by the motor, delayed and limited; N·m
  bool inverted = false;  // in this state, or at the goal
  // Of the control step that begins here: for this torque and the next row's state, as `eval` adds
  // it up. 0 in the last row of a finished rollout, because no step follows.
  double reward = 0;  // sum of the terms
  std::array<double, kRewardTerms> terms{};
  // Only if requested, and if the policy estimates them:
  std::vector<double> q;           // (Q) values of the actions, or only V, in units of reward
  std::optional<Interval> spread;  // central 68% of the torques that the policy would draw
  double chosen = 0;               // chosen torque, before delay and limit
};

struct RolloutConfig {
  const Policy* policy = nullptr;      // chooses the torques; none: the schedule
  std::vector<double> schedule;        // one torque per step; 0 after its end
  PendulumEnvConfig env;               // a single environment
  std::optional<PendulumState> start;  // none: that of the environment's own episode
  double seconds = kEvaluationSeconds;
  bool estimates = false;  // whether rows have the policy's estimates q and spread
  std::string title;       // for figures
};

struct Rollout {
  std::vector<RolloutRow> rows;            // one per control step, and one for the last state
  double control_period = kControlPeriod;  // s
  double return_seconds = kReturnSeconds;  // length of the part that the return counts, s
  // Of this episode:
  Plant plant;
  Disturbance disturbance;
  std::optional<Pose> goal = {};  // of a policy for any pose
};

/// An episode that advances step by step, for RunRollout and `view`.
class Episode {
 public:
  /// The policy must outlive the episode. Throws BadInput as PendulumEnv does.
  explicit Episode(RolloutConfig config);

  /// Adds a row with the present state, then steps the environment. `push` (N·m) adds a torque to
  /// each joint. Throws Failure if the state blows up, or if the physics does not support pushes.
  void Step(const std::array<double, 2>& push = {});

  const RolloutConfig& config() const { return config_; }
  /// The rollout up to the last step.
  const Rollout& rollout() const { return rollout_; }
  int64_t steps() const { return static_cast<int64_t>(rollout_.rows.size()); }
  /// Whether the last step ended the episode; the environment is then in a new episode.
  bool done() const { return result_.done(0); }
  /// The state after `steps` steps, at most steps(), fractions included. Between
  /// two steps it follows the cubic that matches their angles and velocities.
  PendulumState StateAt(double steps) const;
  /// The motor's torque after `steps` steps, N·m.
  double TorqueAt(double steps) const;

 private:
  double period() const { return config_.env.control_period; }
  PendulumState StateOfRow(int64_t k) const;

  RolloutConfig config_;
  std::unique_ptr<PendulumEnv> env_;
  StepResult result_;
  std::unique_ptr<Policy::Memory> memory_;
  Rollout rollout_;
  std::array<double, 2> push_{};  // of the last step, N·m
};

/// Runs an episode to its end. Throws Failure if the state blows up.
Rollout RunRollout(const RolloutConfig& config);

/// The motor's torques over a rollout, with the figures that `eval` computes for an episode:
/// `peak 5 N·m, rms 1.2 N·m, variation 34 N·m/s, once upright 2 N·m/s`.
std::string TorqueText(const Rollout& rollout);

/// The sum of a rollout's rewards, and of the part that `eval` counts: `7100 in 20 s, 2595 in the
/// first 10 s`.
std::string RewardText(const Rollout& rollout);

/// A rollout as CSV, one row for each state: t, state, torque, energy, height, whether it is
/// inverted, reward and its terms, torque at each joint.
std::string RolloutCsv(const Rollout& rollout);

/// The judgement of `eval` on the environment's own episode, such as `success, upright from 2.34 s
/// to the end, return 2345`.
std::string JudgementText(const Policy& policy, const PendulumEnvConfig& config);

/// The conditions that distinguish an episode from others with the same flags: its plant, `mass1
/// 0.93, …`, and the disturbance settings that are not 0.
std::string EpisodeText(const Rollout& rollout);

}  // namespace upswing
