#pragma once

#include <cstdint>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "core/archive.h"
#include "core/env.h"
#include "core/matrix.h"
#include "core/policy.h"
#include "core/steps.h"

namespace upswing {

/// Names and values, in a fixed order.
using Metrics = std::vector<std::pair<std::string, double>>;

/// A learner. The training loop calls Act, Observe, Learn once for each step of the environments.
class Agent {
 public:
  virtual ~Agent() = default;

  /// Actions (N × A) for the observations (N × D), exploring.
  virtual void Act(Matrix<const float> obs, Matrix<double> action) = 0;

  /// The result of the last Act.
  virtual void Observe(const StepResult& result) = 0;

  /// All gradient steps that are due by now. Throws Failure if a number is not finite.
  virtual void Learn() = 0;

  /// Control steps that it has observed, over all environments.
  virtual int64_t steps() const = 0;
  /// Gradient steps since the beginning of the training.
  virtual int64_t updates() const = 0;

  /// What there is to tell of learning, such as the mean loss since the last call. These are
  /// columns of metrics.csv.
  virtual Metrics TakeMetrics() = 0;

  /// The policy as it stands, without exploration. `info` describes it; the agent adds what its
  /// values estimate.
  virtual std::unique_ptr<Policy> ExportPolicy(PolicyInfo info) const = 0;

  /// Saves or loads the whole state.
  virtual void State(const Archive& archive) = 0;
};

/// Throws Failure unless this environment's reward and observation are finite.
void ExpectFinite(const StepResult& result, size_t env);

}  // namespace upswing
