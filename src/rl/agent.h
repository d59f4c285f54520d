#pragma once

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "base/archive.h"
#include "base/env.h"
#include "base/error.h"
#include "base/matrix.h"
#include "base/steps.h"
#include "base/text.h"
#include "nn/network_policy.h"

namespace upswing {

/// Names and values, in a fixed order.
using Metrics = std::vector<std::pair<std::string, double>>;

/// What a DQN agent learned from the first transition (s, a) of its last minibatch, in units of its
/// values, and how it explores.
struct UpdateExample {
  double torque;                 // N·m, of a
  double guess, corrected;       // Q(s, a; θ) before and after the update
  double reward, target;         // Σ γᵏ r, and y
  double epsilon;                // probability of a random torque
  int64_t remembered, capacity;  // transitions in the replay memory
};

/// A learner. The training loop calls Act, Observe and Learn once per step of the environments.
class Agent {
 public:
  virtual ~Agent() = default;

  /// Chooses exploring actions (N × A) for the observations (N × D).
  virtual void Act(Matrix<const float> obs, Matrix<double> action) = 0;

  /// Receives the result of the last Act.
  virtual void Observe(const StepResult& result) = 0;

  /// Makes all gradient steps that are due. Throws Failure if a number is not finite.
  virtual void Learn() = 0;

  /// Control steps observed so far, over all environments.
  virtual int64_t steps() const = 0;
  /// Gradient steps since the beginning of the training.
  virtual int64_t updates() const = 0;

  /// An example of the last update; nothing before the first one, or if the agent gives none.
  virtual std::optional<UpdateExample> LastUpdate() const { return std::nullopt; }

  /// Metrics of learning since the last call, such as the mean loss. They are columns of
  /// metrics.csv.
  virtual Metrics TakeMetrics() = 0;

  /// The current policy, without exploration. `info` describes it. The agent adds the meaning of
  /// its values.
  virtual std::unique_ptr<NetworkPolicy> ExportPolicy(PolicyInfo info) const = 0;

  /// Takes the weights of a policy in place of the initial ones, for the target and the average,
  /// too; critics and optimisers stay. Returns whether its network is that of the agent, or else
  /// changes nothing. PPO takes none: its policies' weights contain the normaliser of inputs.
  virtual bool StartFrom(const NetworkPolicyParts& /*policy*/) { return false; }

  /// Ends all running episodes by a truncation at the observations (N × D) that followed the last
  /// Act.
  virtual void Truncate(Matrix<const float> obs) = 0;

  /// Saves or loads the whole state of the agent.
  virtual void State(const Archive& archive) = 0;
};

/// Throws Failure unless the reward and the observation of environment `env` are finite.
inline void ExpectFinite(const StepResult& result, size_t env) {
  const size_t D = result.next_obs.size() / result.reward.size();
  const auto next_obs = std::span(result.next_obs).subspan(env * D, D);
  const bool finite = std::isfinite(result.reward[env]) &&
                      std::ranges::all_of(next_obs, [](float x) { return std::isfinite(x); });
  if (finite) return;
  throw Failure(Concat("environment ", env, " gave a reward or an observation that is not a ",
                       "finite number"));
}

}  // namespace upswing
