#pragma once

#include <Eigen/Core>
#include <vector>

#include "control/lqr_catch.h"
#include "control/trajectory.h"

namespace upswing {

/// A swing-up from hanging at rest, with feedback that stays near it.
struct SwingUp {
  Trajectory trajectory;
  std::vector<Eigen::RowVector4d> K;  // (T) feedback: u = u_t - K_t (x - x_t)
  std::vector<Eigen::Matrix4d> P;     // (T + 1) cost of a deviation: (x - x_t)' P_t (x - x_t)
};

/// Finds a swing-up by trajectory optimisation from sixteen random guesses, and adds the regulator
/// about the best one. Throws as SolveLqr does, and BadInput if no plan ends where `upright`
/// catches.
SwingUp PlanSwingUp(const LqrConfig& lqr, const SwingUpConfig& config, const LqrCatch& upright,
                    const DesignPlant& plant);

/// Follows a planned swing-up, or its mirror image, with feedback, and holds upright with the
/// regulator whenever that catches. At the start, and after every push, it enters the plan at the
/// place with the lowest cost.
class TvlqrPolicy : public PendulumController {
 public:
  /// Throws as PlanSwingUp does. Takes about half a second.
  TvlqrPolicy(LqrConfig lqr, SwingUpConfig config, const DesignPlant& plant);

  std::string description() const override;
  std::unique_ptr<Memory> Start(int num_envs) const override;

  const SwingUp& plan() const { return plan_; }

 private:
  /// Position of an environment on the plan.
  struct Place {
    int step = -1;    // of the plan; T: upright; -1: not started
    double sign = 1;  // -1: on its mirror image
  };
  struct Places : Memory {
    std::vector<Place> of_env;  // (N)
  };

  double Torque(const StateVector& deviation, size_t env, Memory& memory) const override;
  /// The deviation from upright, relative to a place of the plan.
  StateVector OffPlan(const StateVector& deviation, const Place& place) const;

  LqrCatch upright_;
  SwingUp plan_;
};

}  // namespace upswing
