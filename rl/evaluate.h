#pragma once

#include <functional>
#include <span>
#include <string>
#include <vector>

#include "core/sample.h"
#include "core/thread_pool.h"
#include "core/vector_env.h"
#include "nn/policy.h"

namespace upswing {

inline constexpr double kEvaluationSeconds = 20;  // length of an evaluation episode
inline constexpr double kHoldSeconds = 10;  // success: every state of the last so many at the goal
inline constexpr double kReturnSeconds = 10;  // the return counts the first so many

/// What one evaluation episode came to.
struct EvaluationEpisode {
  bool success = false;
  double swing_up_seconds = 0;   // start of the last stretch at the goal that lasts to the end;
                                 // kEvaluationSeconds if the end is not at the goal
  double reward_sum = 0;         // return: undiscounted, over the first kReturnSeconds
  double work = 0;               // Σ |mechanical work of the motor|, J
  double peak_torque = 0;        // largest |torque|, N·m
  double rms_torque = 0;         // root mean square, N·m
  double value = 0;              // largest Q-value of the first observation, in units of reward
  double discounted_return = 0;  // Σ γᵏ r over the whole episode: what that estimates, if the
                                 // policy learned from the reward that is judged
  std::vector<double> terms;     // (K) sum of each reward term over the first kReturnSeconds
};

/// An evaluation in figures.
struct Evaluation {
  int64_t episodes = 0, successes = 0;
  Interval success_interval;
  Quartiles swing_up_seconds;  // of the successful episodes
  Moments reward_sum, work, rms_torque;
  double peak_torque = 0;
  double value = 0, discounted_return = 0;  // means; 0 for a policy that does not say its γ
  std::vector<double> term_means;           // (K) of the episodes' sums of each reward term

  double success_rate() const {
    return episodes == 0 ? 0 : static_cast<double>(successes) / static_cast<double>(episodes);
  }
  bool all_succeeded() const { return episodes > 0 && successes == episodes; }
};

/// Lets `policy` control every environment for kEvaluationSeconds from where it stands, and says
/// what each episode came to. The environments must not end before that. Acting is shared by the
/// pool, which changes no bit. `progress` (may be empty) is told the share done.
std::vector<EvaluationEpisode> EvaluateEpisodes(const Policy& policy, VectorEnv& env,
                                                ThreadPool* pool = nullptr,
                                                const std::function<void(double)>& progress = {});

/// The episodes in figures.
Evaluation Summarize(std::span<const EvaluationEpisode> episodes);

/// Both in one.
Evaluation Evaluate(const Policy& policy, VectorEnv& env, ThreadPool* pool = nullptr,
                    const std::function<void(double)>& progress = {});

}  // namespace upswing
