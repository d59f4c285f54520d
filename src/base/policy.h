#pragma once

#include <memory>
#include <string>

#include "base/matrix.h"
#include "base/policy_info.h"
#include "base/tensors.h"

namespace upswing {

/// A controller: observation → action. All controllers, learned or not, share this interface for
/// evaluation, maps, plots, simulation and comparison. A controller sees only observations, so that
/// noise and delay affect all controllers alike. Immutable: data that a controller keeps from step
/// to step belongs to a Memory.
class Policy {
 public:
  virtual ~Policy() = default;

  /// Kind of controller, such as "q-network" or "lqr".
  virtual std::string kind() const = 0;
  /// Description for people, such as "greedy policy of a plain Q-network 8-64-64-9".
  virtual std::string description() const = 0;
  virtual int obs_size() const = 0;     // D
  virtual int action_size() const = 0;  // A
  /// Origin and purpose of the controller.
  virtual const PolicyInfo& info() const = 0;
  /// Number of learned parameters; 0: none.
  virtual size_t num_parameters() const { return 0; }

  /// Working memory for some environments: buffers, and plans or estimates if the controller keeps
  /// them. Each thread has its own.
  class Memory {
   public:
    virtual ~Memory() = default;
  };
  /// Makes the memory for `num_envs` environments at the beginning of their episodes.
  virtual std::unique_ptr<Memory> Start(int num_envs) const = 0;

  /// Writes the actions (N × A) for the observations (N × D) of the environments. Several threads
  /// may call it, each with its own memory. The action of a row does not depend on the other rows.
  virtual void Act(Matrix<const float> obs, Matrix<double> action, Memory& memory) const = 0;

  /// Number of values that the controller estimates per observation: one Q-value per action, or 1
  /// for V; 0: none. Their unit follows from info().gamma and info().reward_scale.
  virtual int num_values() const { return 0; }
  /// Writes the values (N × num_values). The greedy action has the largest Q-value.
  virtual void Values(Matrix<const float> /*obs*/, Matrix<float> /*values*/, Memory&) const {}
  /// The actions (num_values × A) that the Q-values belong to; empty for V.
  virtual Matrix<const double> value_actions() const { return {}; }

  /// Whether the policy learned a distribution of actions. Act takes its middle.
  virtual bool has_spread() const { return false; }
  /// Writes the ends (N × A each) of the central 68% of the action distribution. For a Gaussian,
  /// they are one standard deviation below and above the mean.
  virtual void Spread(Matrix<const float> /*obs*/, Matrix<double> /*low*/, Matrix<double> /*high*/,
                      Memory&) const {}

  /// The contents of the policy file (docs/reference/policy-format.md). Throws BadInput if this
  /// kind of controller has no file format.
  virtual Tensors ToTensors() const = 0;
};

}  // namespace upswing
