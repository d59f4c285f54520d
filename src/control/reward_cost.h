#pragma once

#include "control/trajectory.h"
#include "pendulum/task_config.h"

namespace upswing {

/// The task's reward, smoothed and turned into a cost: the largest reward of a step (7.5 with the
/// usual weights) minus the reward. A logistic function of the link's cosine, about `width` wide,
/// replaces the test for being within 30° of upright. A smaller width is more accurate and harder
/// to optimise. Second derivatives with negative curvature, and mixed ones of state and torque, are
/// left out. A step's reward is that of its first state.
class RewardCost : public TrajectoryCost {
 public:
  RewardCost(const Plant& plant, const RewardConfig& weights, double width)
      : plant_(plant), weights_(weights), width_(width) {}

  double Running(const StateVector& x, double u) const override;
  /// The final state counts like one more step.
  double Final(const StateVector& x) const override { return Running(x, 0); }
  CostExpansion ExpandRunning(const StateVector& x, double u) const override;
  CostExpansion ExpandFinal(const StateVector& x) const override { return ExpandRunning(x, 0); }

 private:
  /// Smooth degree to which a state is inverted, in [0, 1].
  double Inversion(const StateVector& x) const;

  Plant plant_;
  RewardConfig weights_;
  double width_;
};

}  // namespace upswing
