#pragma once

#include <numbers>
#include <optional>
#include <span>
#include <variant>
#include <vector>

#include "base/env.h"
#include "base/policy.h"
#include "base/progress.h"
#include "base/sample.h"
#include "base/thread_pool.h"

namespace upswing {

inline constexpr double kSteadyTiltSeconds = 1;  // steady tilt: mean lean over the last 1 s
/// Largest lean of a settled body, rad: 5% of the half turn from hanging to upright.
inline constexpr double kSettledTilt = 0.05 * std::numbers::pi;

/// Smallest change of a torque that counts as chatter, as a share of its limit.
inline constexpr double kLeastChange = 1e-3;

/// Results of one evaluation episode.
struct EvaluationEpisode {
  bool success = false;
  bool diverged = false;  // ended by a numerical blow-up; a failure
  double seconds = 0;     // length; a termination makes it shorter than the rule's time
  // Start of the stretch at the goal, and of the settled stretch, with which the episode ends.
  // Nothing if the episode does not end at the goal, or not settled.
  std::optional<double> swing_up_seconds, settling_seconds;
  double reward_sum = 0;  // return: Σ return_weight · r over the first return_seconds
  double work = 0;        // Σ |mechanical work of the motor|, J
  // Torques over the episode, in the unit of the task's actions, such as N·m.
  double peak_torque = 0;       // largest |torque|
  double rms_torque = 0;        // root mean square
  double torque_variation = 0;  // total variation Σ |τₖ - τₖ₋₁| per second
  // Torques in the stretch at the goal with which the episode ends; 0 if there is none or it has no
  // steps.
  double goal_variation = 0;  // total variation of the torque per second
  double goal_changes = 0;    // number of torque changes above kLeastChange per second
  double value = 0;           // largest value of the first observation, in units of reward
  /// Σ γᵏ r over the whole episode. `value` estimates it if the policy was trained with the same
  /// reward.
  double discounted_return = 0;
  std::vector<double> terms;  // (K) the return's part of each reward term
  std::vector<double> tilt;   // (bodies) mean lean over the last kSteadyTiltSeconds, rad
};

/// Summary of an evaluation.
struct Evaluation {
  int64_t episodes = 0, successes = 0, diverged = 0;
  Interval success_interval;
  Quartiles swing_up_seconds;  // of the successful episodes
  int64_t settled = 0;         // successful episodes that are settled at the end
  Quartiles settling_seconds;  // of the settled episodes
  Moments seconds, reward_sum, work, rms_torque, torque_variation;
  Moments goal_variation, goal_changes;  // at the goal, of the successful episodes
  std::vector<Moments> tilt;  // (bodies) |mean lean| at the end of the successful episodes, rad
  double peak_torque = 0;
  double value = 0, discounted_return = 0;  // means; 0 for a policy without γ in its file
  std::vector<double> term_means;           // (K) mean of the episodes' sums of each reward term

  double success_rate() const {
    return episodes == 0 ? 0 : static_cast<double>(successes) / static_cast<double>(episodes);
  }
  /// Whether the evaluation is passed by the task's rule.
  bool passed = false;
};

/// A figure of episodes and evaluations: its names in files, and its places in the structs.
struct EvaluationFigure {
  /// When the figure is known. kUpright, kSettled: for episodes that end at the goal or settled, in
  /// tasks with a goal to hold. kValued: for policies that estimate values.
  enum class Known { kAlways, kUpright, kSettled, kValued };

  const char* name;    // name in JSON and in the table of episodes
  const char* column;  // column of its mean or median in evals.csv; null: no column
  Known known;
  std::variant<double Evaluation::*, Moments Evaluation::*, Quartiles Evaluation::*> summary;
  std::variant<double EvaluationEpisode::*, std::optional<double> EvaluationEpisode::*> result;

  /// Value of the figure, as a mean or median for an evaluation.
  double Of(const Evaluation& evaluation) const;
  std::optional<double> Of(const EvaluationEpisode& episode) const;
};

/// All figures, in the order of the columns of evals.csv.
std::span<const EvaluationFigure> EvaluationFigures();

/// Running statistics of an episode's torques.
class TorqueTally {
 public:
  /// Tally for motors with these torque limits (A).
  TorqueTally(std::span<const double> limit, double step_seconds)
      : seconds_(step_seconds), limit_(limit.begin(), limit.end()), last_(limit.size()) {}

  /// Adds the torques (A) of a step. `at_goal` says whether the step leads to the goal.
  void Add(std::span<const double> torque, bool at_goal);

  int64_t steps() const { return steps_; }
  /// Index of the first state of the current stretch at the goal; -1 if the state is not at the
  /// goal.
  int64_t goal_since() const { return goal_since_; }
  /// Whether the current stretch at the goal has at least one step.
  bool has_goal_steps() const { return goal_since_ >= 0 && goal_since_ < steps_; }

  /// Sets the torque figures of the episode. Sets the figures for the stretch at the goal only if
  /// `at_goal`.
  void Finish(bool at_goal, EvaluationEpisode& episode) const;

 private:
  double seconds_;                    // length of a step
  std::vector<double> limit_, last_;  // (A)
  int64_t steps_ = 0, goal_since_ = -1;
  double peak_ = 0, squares_ = 0, variation_ = 0;
  double goal_variation_ = 0;  // in the current stretch at the goal
  int64_t goal_changes_ = 0;
};

/// Ratio of the value at the start to the attained discounted return. Infinite unless the return is
/// above 0.
double ValueRatio(double value, double discounted_return);

/// Lets `policy` control every environment from its current state for the time of the task's rule.
/// Returns one result per environment. An episode may end earlier. The pool shares the work, which
/// changes no bit. `progress` counts episodes.
std::vector<EvaluationEpisode> EvaluateEpisodes(const Policy& policy, VectorEnv& env,
                                                ThreadPool* pool = nullptr,
                                                const Progress& progress = {});

/// Summarises the episodes of a task that has this rule.
Evaluation Summarize(std::span<const EvaluationEpisode> episodes, const EvaluationRule& rule);

/// The evaluations of a training.
class Evaluator {
 public:
  virtual ~Evaluator() = default;
  /// Whether Evaluate and Confirm may run on another thread while the training goes on.
  virtual bool CanRunInBackground() const { return false; }
  /// Divides the threads between the training and the evaluation that runs in the background if
  /// `shared`. Otherwise the one that runs has all threads.
  virtual void ShareThreads(bool /*shared*/) {}
  /// Evaluates the policy of a step, from new start states at each step.
  virtual Evaluation Evaluate(const Policy& policy, int64_t step) = 0;
  /// A stricter and slower evaluation, whose result replaces that of Evaluate; nothing: there is
  /// none. Before the task counts as solved, it judges the second passed policy in a row.
  /// Afterwards it judges each policy that would become the best.
  virtual std::optional<Evaluation> Confirm(const Policy& /*policy*/, int64_t /*step*/) {
    return std::nullopt;
  }
};

/// Runs EvaluateEpisodes, then Summarize.
Evaluation Evaluate(const Policy& policy, VectorEnv& env, ThreadPool* pool = nullptr,
                    const Progress& progress = {});

}  // namespace upswing
