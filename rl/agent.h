#pragma once

#include <cstdint>
#include <span>
#include <string>

#include "core/archive.h"
#include "core/matrix.h"
#include "core/vector_env.h"
#include "nn/policy.h"

namespace upswing {

/// More control steps, over all environments, than any training makes.
inline constexpr int64_t kMostSteps = 2'000'000'000'000;

/// Learning metrics of an agent: means over the updates since BeginReport.
struct AgentReport {
  int64_t updates = 0;       // gradient steps since the beginning of the run
  double epsilon = 0;        // present share of random actions
  double learning_rate = 0;  // present
  double loss = 0;           // mean Huber loss of scaled rewards
  double q = 0;              // mean Q-value of the sampled actions
  double td_error = 0;       // mean |temporal-difference error|
  double gradient_norm = 0;  // mean, before clipping
  // Of the last update's features; see rl/representation.h. Before the first there are none: 0
  // and 1.
  double feature_rank = 0, dormant_share = 1;
};

/// A learner. The training loop calls Act, Observe, Learn once for each step of the environments.
class Agent {
 public:
  virtual ~Agent() = default;

  /// Torques (N) for the observations (N × D), exploring.
  virtual void Act(Matrix<const float> obs, std::span<double> torque) = 0;

  /// The result of the last Act.
  virtual void Observe(const StepResult& result) = 0;

  /// All gradient steps that are due by now. Throws Failure if a number is not finite.
  virtual void Learn() = 0;

  /// Control steps that it has observed, over all environments.
  virtual int64_t steps() const = 0;

  /// The metrics since BeginReport.
  virtual AgentReport Report() const = 0;

  /// Resets the report's averages.
  virtual void BeginReport() = 0;

  /// The greedy policy as it stands, with `info` in its file, to which it adds what
  /// its Q-values estimate.
  virtual Policy ExportPolicy(PolicyInfo info) const = 0;

  /// Saves or loads the whole state.
  virtual void State(const Archive& archive) = 0;
};

}  // namespace upswing
