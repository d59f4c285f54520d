#pragma once

#include <Eigen/Core>
#include <optional>
#include <vector>

#include "control/lqr_catch.h"
#include "control/trajectory.h"
#include "core/rng.h"

namespace upswing {

/// A swing-up from hanging at rest, and how to stay near it.
struct SwingUp {
  Trajectory trajectory;
  std::vector<Eigen::RowVector4d> K;  // (T) feedback: u = u_t - K_t (x - x_t)
  std::vector<Eigen::Matrix4d> P;  // (T + 1) what leaving the plan costs: (x - x_t)' P_t (x - x_t)
};

/// The time-varying linear-quadratic regulator about a trajectory, whose end costs x' P x: Tedrake,
/// "Underactuated Robotics", chapter 8. `model` is one of the plant.
SwingUp Tracking(Trajectory trajectory, const LqrConfig& lqr, const Eigen::Matrix4d& P,
                 PendulumModel& model);

/// A swing-up from hanging of so many control periods, held upright from wherever it is, that
/// trajectory optimisation finds from a random guess: a sine wave of torque of any amplitude, once
/// in 1 to 2 s, of any length, and any price of the way against that of its end. Nothing if that
/// does not end where `upright` catches.
std::optional<Trajectory> GuessSwingUp(const LqrConfig& lqr, const LqrCatch& upright, int steps,
                                       Rng& rng, TrajectoryOptimizer& optimizer);

/// The best of the plans that GuessSwingUp finds in sixteen tries, improved, and the regulator
/// about it. Throws as SolveLqr, and BadInput if no plan ends where `upright` catches.
SwingUp PlanSwingUp(const LqrConfig& lqr, const SwingUpConfig& config, const LqrCatch& upright,
                    const Plant& plant);

/// Follows a planned swing-up, or its mirror image, with feedback, and holds upright with the
/// regulator wherever that catches. Where it begins, and whenever it is pushed off, it enters the
/// plan where that costs least.
class TvlqrPolicy : public PendulumController {
 public:
  /// Throws as PlanSwingUp. Takes about half a second.
  TvlqrPolicy(LqrConfig lqr, SwingUpConfig config, const Plant& plant);

  std::string description() const override;
  std::unique_ptr<Memory> Start(int num_envs) const override;

  const SwingUp& plan() const { return plan_; }

 private:
  /// Where an environment is on the plan.
  struct Place {
    int step = -1;    // of the plan; T: upright; -1: not begun
    double sign = 1;  // -1: on its mirror image
  };
  struct Places;

  double Torque(const StateVector& deviation, size_t env, Memory& memory) const override;
  /// From that place of the plan to a deviation from upright.
  StateVector OffPlan(const StateVector& deviation, const Place& place) const;

  LqrCatch upright_;
  SwingUp plan_;
};

}  // namespace upswing
