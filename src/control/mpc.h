#pragma once

#include <memory>
#include <vector>

#include "control/lqr.h"
#include "control/settings.h"
#include "control/trajectory.h"

namespace upswing {

/// Model predictive control by trajectory optimisation. Each decision improves the previous plan
/// from the present state, and applies the plan's first torque. Tassa, Erez, Todorov, "Synthesis
/// and stabilization of complex behaviors through online trajectory optimization" (IROS 2012).
class MpcPolicy : public PendulumController {
 public:
  /// Most iterations for the first plan of an episode, which has no previous plan.
  static constexpr int kFirstIterations = 100;

  /// Throws as SolveLqr does.
  MpcPolicy(LqrConfig lqr, MpcConfig config, const DesignPlant& plant);

  std::string description() const override;
  int planning_steps() const { return planning_steps_; }
  std::unique_ptr<Memory> Start(int num_envs) const override;
  /// Begins one environment with a plan (T) and feedback (T) about it, as if a decision had made
  /// them.
  std::unique_ptr<Memory> StartFrom(const Trajectory& plan,
                                    const std::vector<Eigen::RowVector4d>& K) const;

 private:
  struct Plans;

  double Torque(const StateVector& deviation, size_t env, Memory& memory) const override;
  /// The first plan (T) of an episode from x: the cheapest one that the guesses lead to.
  Trajectory FirstPlan(TrajectoryOptimizer& optimizer, const StateVector& x, size_t T) const;

  MpcConfig config_;
  int planning_steps_;  // Runge-Kutta steps in a control period of a plan
  Lqr lqr_;
  QuadraticCost cost_;
};

}  // namespace upswing
