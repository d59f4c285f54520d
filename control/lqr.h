#pragma once

#include "control/controller.h"
#include "control/riccati.h"
#include "control/settings.h"
#include "sim/double_pendulum.h"

/// The linear-quadratic regulator about upright: Anderson, Moore, "Optimal Control: Linear
/// Quadratic Methods" (1990); Tedrake, "Underactuated Robotics", chapter 8. It is the best
/// controller of the linear model; of the pendulum it is one near upright, as long as the torque is
/// within its limit.
namespace upswing {

/// Q, diagonal.
Eigen::Matrix4d WeightsOf(const LqrConfig& config);

/// Solves the problem for a plant and the control period. Throws BadInput if the plant cannot be
/// stabilised by its motor, or if no gain that these weights make stabilises it.
Lqr SolveLqr(const LqrConfig& config, const Plant& plant);

/// u = -K x, at most the torque limit.
class LqrPolicy : public PendulumController {
 public:
  /// Throws as SolveLqr.
  LqrPolicy(LqrConfig config, const Plant& plant);

  std::string description() const override;

  const Lqr& lqr() const { return lqr_; }

 private:
  double Torque(const StateVector& deviation, size_t env, Memory& memory) const override;

  LqrConfig config_;
  Lqr lqr_;
};

}  // namespace upswing
