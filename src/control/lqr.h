#pragma once

#include "control/controller.h"
#include "control/riccati.h"
#include "control/settings.h"
#include "pendulum/plant.h"

/// The linear-quadratic regulator about upright: Anderson, Moore, "Optimal Control: Linear
/// Quadratic Methods" (1990); Tedrake, "Underactuated Robotics", chapter 8. It is the best
/// controller of the linear model. It controls the pendulum near upright, as long as the torque is
/// within its limit.
namespace upswing {

/// The diagonal matrix Q.
Eigen::Matrix4d WeightsOf(const LqrConfig& config);

/// The plant about upright over one control period: the Jacobian of the simulation's steps. Throws
/// BadInput if the plant is too stiff.
LinearModel UprightModel(const DesignPlant& plant);

/// Solves the regulator problem for a plant and the control period. Throws BadInput if the plant's
/// motor cannot stabilise it, or if no gain from these weights does.
Lqr SolveLqr(const LqrConfig& config, const DesignPlant& plant);

/// The controller u = -K x, cut at the torque limit.
class LqrPolicy : public PendulumController {
 public:
  /// Throws as SolveLqr does.
  LqrPolicy(LqrConfig config, const DesignPlant& plant);

  std::string description() const override;

  const Lqr& lqr() const { return lqr_; }

 private:
  double Torque(const StateVector& deviation, size_t env, Memory& memory) const override;

  LqrConfig config_;
  Lqr lqr_;
};

}  // namespace upswing
