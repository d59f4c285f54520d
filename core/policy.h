#pragma once

#include <memory>
#include <string>

#include "core/matrix.h"
#include "core/policy_info.h"
#include "core/tensors.h"

namespace upswing {

/// A controller: observation → action. Learned networks, LQR and all others are peers: evaluation,
/// maps, plots, simulation and comparison take any of them. Policies see observations alone, so
/// that noise and delay treat all alike. Immutable: what a policy needs from step to step belongs
/// to a Memory.
class Policy {
 public:
  virtual ~Policy() = default;

  /// Such as "q-network" or "lqr".
  virtual std::string kind() const = 0;
  /// What it is, for people, such as "greedy policy of a plain Q-network 8-64-64-9".
  virtual std::string description() const = 0;
  virtual int obs_size() const = 0;     // D
  virtual int action_size() const = 0;  // A
  /// What it was made for, and how.
  virtual const PolicyInfo& info() const = 0;
  /// How many numbers were learned; 0: none.
  virtual size_t num_parameters() const { return 0; }

  /// What acting for some environments needs: buffers, and for a policy with a past its plans or
  /// estimates. Each thread has its own.
  class Memory {
   public:
    virtual ~Memory() = default;
  };
  /// The memory of `num_envs` environments at the beginning of their episodes.
  virtual std::unique_ptr<Memory> Start(int num_envs) const = 0;

  /// The actions (N × A) for the observations (N × D) of these environments. Safe from several
  /// threads, each with its own memory; a row's action does not depend on the other rows.
  virtual void Act(Matrix<const float> obs, Matrix<double> action, Memory& memory) const = 0;

  /// How many values it estimates of an observation: a Q-value for each of its actions, or 1 for
  /// V; 0: none. Their unit is that of info().gamma and reward_scale.
  virtual int num_values() const { return 0; }
  /// These values (N × num_values); the largest is that of the greedy action.
  virtual void Values(Matrix<const float> /*obs*/, Matrix<float> /*values*/, Memory&) const {}
  /// The actions (num_values × A) that the values belong to; empty for V.
  virtual Matrix<const double> value_actions() const { return {}; }

  /// Whether it was learned as a distribution of actions, of which Act takes the middle.
  virtual bool has_spread() const { return false; }
  /// The ends (N × A each) of the central 68% of that distribution; of a Gaussian they are one
  /// standard deviation below and above its mean.
  virtual void Spread(Matrix<const float> /*obs*/, Matrix<double> /*low*/, Matrix<double> /*high*/,
                      Memory&) const {}

  /// What its file holds (docs/reference/policy-format.md). Throws BadInput if this kind is not
  /// kept in files.
  virtual Tensors ToTensors() const = 0;
};

}  // namespace upswing
