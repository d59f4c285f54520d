#pragma once

#include <numbers>
#include <optional>
#include <span>
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

/// What values estimate: the sum of γᵏ · reward_scale · r, by the policy's metadata.
struct ValueUnits {
  double gamma = 0, reward_scale = 1;  // γ = 0: the metadata have none
};
/// The units in a policy's metadata.
ValueUnits ValueUnitsOf(const Policy& policy);

/// Lets `policy` control every environment from its present state for as long as the task's rule
/// says, and returns one result for each. Episodes must not time out earlier. The pool shares the
/// forward passes, which changes no bit. `progress` counts episodes.
std::vector<EvaluationEpisode> EvaluateEpisodes(const Policy& policy, VectorEnv& env,
                                                ThreadPool* pool = nullptr,
                                                const Progress& progress = {});

/// Summarises episodes of a task with this rule.
Evaluation Summarize(std::span<const EvaluationEpisode> episodes, const EvaluationRule& rule);

/// EvaluateEpisodes, then Summarize.
Evaluation Evaluate(const Policy& policy, VectorEnv& env, ThreadPool* pool = nullptr,
                    const Progress& progress = {});

}  // namespace upswing
