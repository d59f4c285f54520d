#pragma once

#include <numbers>
#include <optional>
#include <span>
#include <variant>
#include <vector>

#include "core/env.h"
#include "core/policy.h"
#include "core/progress.h"
#include "core/sample.h"
#include "core/thread_pool.h"

namespace upswing {

inline constexpr double kSteadyTiltSeconds = 1;  // the steady tilt is the mean of the last 1 s
/// Settled: every body leans less than this, rad: 5% of the half turn from hanging to upright.
inline constexpr double kSettledTilt = 0.05 * std::numbers::pi;

/// Results of one evaluation episode.
struct EvaluationEpisode {
  bool success = false;
  double seconds = 0;  // its length; it may terminate before the time that the rule gives it
  // Start of the last stretch at the goal, and of the last one settled, that lasts to the end; none
  // if the end is not.
  std::optional<double> swing_up_seconds, settling_seconds;
  double reward_sum = 0;  // return: undiscounted, over the first return_seconds
  double work = 0;        // Σ |mechanical work of the motor|, J
  // Of the torques, in the task's unit of actions, such as N·m:
  double peak_torque = 0;       // largest |torque|
  double rms_torque = 0;        // root mean square
  double torque_variation = 0;  // total variation Σ |τₖ - τₖ₋₁| a second
  // Of the last stretch at the goal; 0 if there is none or it has no length.
  double goal_variation = 0;     // the torque's total variation a second
  double goal_changes = 0;       // how often a second the torque changes
  double value = 0;              // largest value of the first observation, in units of reward
  double discounted_return = 0;  // Σ γᵏ r over the whole episode: what `value` estimates, if the
                                 // policy was trained with the same reward
  std::vector<double> terms;  // (K) sum of each reward term over the first return_seconds
  std::vector<double> tilt;   // (bodies) mean lean over the last kSteadyTiltSeconds, rad
};

/// Summary of an evaluation.
struct Evaluation {
  int64_t episodes = 0, successes = 0;
  Interval success_interval;
  Quartiles swing_up_seconds;  // of the successful episodes
  int64_t settled = 0;         // successful episodes that are settled at the end
  Quartiles settling_seconds;  // of those episodes
  Moments seconds, reward_sum, work, rms_torque, torque_variation;
  Moments goal_variation, goal_changes;  // of the successful episodes
  std::vector<Moments> tilt;  // (bodies) |mean lean| at the end of the successful episodes, rad
  double peak_torque = 0;
  double value = 0, discounted_return = 0;  // means; 0 for a policy without γ in its file
  std::vector<double> term_means;           // (K) of the episodes' sums of each reward term

  double success_rate() const {
    return episodes == 0 ? 0 : static_cast<double>(successes) / static_cast<double>(episodes);
  }
  /// Whether it is passed, by the rule of the task.
  bool passed = false;
};

/// A figure of episodes and evaluations: its names in files, and where it is.
struct EvaluationFigure {
  /// Always; of episodes upright at the end, and of those settled then, in tasks whose goal is
  /// held; of policies that estimate values.
  enum class Known { kAlways, kUpright, kSettled, kValued };

  const char* name;    // in JSON and in the table of episodes
  const char* column;  // of its mean or median in evals.csv; null: not there
  Known known;
  std::variant<double Evaluation::*, Moments Evaluation::*, Quartiles Evaluation::*> summary;
  std::variant<double EvaluationEpisode::*, std::optional<double> EvaluationEpisode::*> result;

  /// Its value, mean or median.
  double Of(const Evaluation& evaluation) const;
  std::optional<double> Of(const EvaluationEpisode& episode) const;
};

/// All of them, in the order of the columns of evals.csv.
std::span<const EvaluationFigure> EvaluationFigures();

/// Accumulates the torques of an episode, step by step.
class TorqueTally {
 public:
  /// Of `size` motors.
  TorqueTally(size_t size, double step_seconds) : seconds_(step_seconds), last_(size) {}

  /// Adds the torques (A) of a step, and whether it leads to the goal.
  void Add(std::span<const double> torque, bool at_goal);

  int64_t steps() const { return steps_; }
  /// First state of the present stretch at the goal; -1: it is not there.
  int64_t goal_since() const { return goal_since_; }
  /// Whether that stretch has a step.
  bool has_goal_steps() const { return goal_since_ >= 0 && goal_since_ < steps_; }

  /// Sets the figures of the torques; those of the stretch only `at_goal`.
  void Finish(bool at_goal, EvaluationEpisode& episode) const;

 private:
  double seconds_;            // of a step
  std::vector<double> last_;  // (A)
  int64_t steps_ = 0, goal_since_ = -1;
  double peak_ = 0, squares_ = 0, variation_ = 0;
  double goal_variation_ = 0;  // in the present stretch at the goal
  int64_t goal_changes_ = 0;
};

/// What values estimate: the sum of γᵏ · reward_scale · r, by the policy's metadata.
struct ValueUnits {
  double gamma = 0, reward_scale = 1;  // γ = 0: the metadata have none
};
/// The units in a policy's metadata.
ValueUnits ValueUnitsOf(const Policy& policy);

/// What a policy expects at the start over what it attains; infinite unless it attains more than 0.
double ValueRatio(double value, double discounted_return);

/// Lets `policy` control every environment from its present state for as long as the task's rule
/// says, and returns one result for each. Episodes must not time out earlier. The pool shares the
/// work, which changes no bit. `progress` counts episodes.
std::vector<EvaluationEpisode> EvaluateEpisodes(const Policy& policy, VectorEnv& env,
                                                ThreadPool* pool = nullptr,
                                                const Progress& progress = {});

/// Summarises episodes of a task with this rule.
Evaluation Summarize(std::span<const EvaluationEpisode> episodes, const EvaluationRule& rule);

/// EvaluateEpisodes, then Summarize.
Evaluation Evaluate(const Policy& policy, VectorEnv& env, ThreadPool* pool = nullptr,
                    const Progress& progress = {});

}  // namespace upswing
