#pragma once

#include "control/trajectory.h"
#include "sim/double_pendulum.h"

namespace upswing {

/// The task's reward, smooth, as a cost: the most that a step can give (7.5 with the usual weights)
/// minus what it gives. Where the task asks whether a link is within 30° of upright, a logistic
/// function of its cosine rises over about `width` instead; the smaller, the truer and the harder
/// to follow. Second derivatives that curve down are left out, and those by state and torque. A
/// step's reward is that of the state that it begins in.
class RewardCost : public TrajectoryCost {
 public:
  RewardCost(const Plant& plant, const RewardWeights& weights, double width)
      : plant_(plant), weights_(weights), width_(width) {}

  double Running(const StateVector& x, double u) const override;
  /// As if the rest of the trajectory were one more step.
  double Final(const StateVector& x) const override { return Running(x, 0); }
  CostExpansion ExpandRunning(const StateVector& x, double u) const override;
  CostExpansion ExpandFinal(const StateVector& x) const override { return ExpandRunning(x, 0); }

 private:
  /// How far a state counts as inverted, in [0, 1].
  double Inversion(const StateVector& x) const;

  Plant plant_;
  RewardWeights weights_;
  double width_;
};

}  // namespace upswing
