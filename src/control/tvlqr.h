#pragma once

#include <Eigen/Core>
#include <optional>
#include <vector>

#include "base/rng.h"
#include "control/lqr_catch.h"
#include "control/trajectory.h"

namespace upswing {

/// A swing-up from hanging at rest, with feedback that stays near it.
struct SwingUp {
  Trajectory trajectory;
  std::vector<Eigen::RowVector4d> K;  // (T) feedback: u = u_t - K_t (x - x_t)
  std::vector<Eigen::Matrix4d> P;     // (T + 1) cost of a deviation: (x - x_t)' P_t (x - x_t)
};

/// The time-varying linear-quadratic regulator about a trajectory, with the final cost x' P x:
/// Tedrake, "Underactuated Robotics", chapter 8. `model` is a model of the same plant.
SwingUp Tracking(Trajectory trajectory, const LqrConfig& lqr, const Eigen::Matrix4d& P,
                 PendulumModel& model);

/// A swing-up from hanging of `steps` control periods, found by trajectory optimisation from a
/// random guess. The guess is a sine wave of torque with a period of 1 to 2 s; amplitude, length
/// and the price of the way against its end are random. The regulator holds from the wave's end to
/// the plan's end. Returns nothing if the result does not end where `upright` catches.
std::optional<Trajectory> GuessSwingUp(const LqrConfig& lqr, const LqrCatch& upright, int steps,
                                       Rng& rng, TrajectoryOptimizer& optimizer);

/// Improves the best plan of sixteen tries of GuessSwingUp, and adds the regulator about it. Throws
/// as SolveLqr does, and BadInput if no plan ends where `upright` catches.
SwingUp PlanSwingUp(const LqrConfig& lqr, const SwingUpConfig& config, const LqrCatch& upright,
                    const Plant& plant);

/// Follows a planned swing-up, or its mirror image, with feedback, and holds upright with the
/// regulator whenever that catches. At the start, and after every push, it enters the plan at the
/// place with the lowest cost.
class TvlqrPolicy : public PendulumController {
 public:
  /// Throws as PlanSwingUp does. Takes about half a second.
  TvlqrPolicy(LqrConfig lqr, SwingUpConfig config, const Plant& plant);

  std::string description() const override;
  std::unique_ptr<Memory> Start(int num_envs) const override;

  const SwingUp& plan() const { return plan_; }

 private:
  /// Position of an environment on the plan.
  struct Place {
    int step = -1;    // of the plan; T: upright; -1: not started
    double sign = 1;  // -1: on its mirror image
  };

  double Torque(const StateVector& deviation, size_t env, Memory& memory) const override;
  /// The deviation from upright, relative to a place of the plan.
  StateVector OffPlan(const StateVector& deviation, const Place& place) const;

  LqrCatch upright_;
  SwingUp plan_;
};

}  // namespace upswing
