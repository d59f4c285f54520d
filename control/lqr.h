#pragma once

#include <Eigen/Core>
#include <algorithm>

#include "control/controller.h"
#include "core/options.h"
#include "sim/double_pendulum.h"

/// The linear-quadratic regulator about upright: Anderson, Moore, "Optimal Control: Linear
/// Quadratic Methods" (1990); Tedrake, "Underactuated Robotics", chapter 8. It is the best
/// controller of the linear model; of the pendulum it is one near upright, as long as the torque is
/// within its limit.
namespace upswing {

/// What is minimised: Σ x' Q x + R u² over the control steps, x = [q1 - π, q2, w1, w2] (rad,
/// rad/s), u the torque (N·m), Q diagonal.
struct LqrConfig {
  double q1 = 10, q2 = 10;  // of Q, 1/rad²
  double w1 = 1, w2 = 1;    // of Q, s²/rad²
  double torque = 1;        // R, 1/(N·m)²

  /// One line per setting: name, range, unit, help.
  void Describe(Options& options);

  Eigen::Matrix4d Q() const { return Eigen::Vector4d(q1, q2, w1, w2).asDiagonal(); }
};

/// The solution.
struct Lqr {
  Eigen::RowVector4d K;  // gain: u = -K x, N·m/rad and N·m·s/rad
  Eigen::Matrix4d P;     // least cost from x: x' P x

  /// u (N·m) of a deviation x from upright.
  double Torque(const StateVector& x) const { return -K.dot(x); }
  /// The same within ±limit.
  double Torque(const StateVector& x, double limit) const {
    return std::clamp(Torque(x), -limit, limit);
  }
  /// The least cost from there.
  double Cost(const StateVector& x) const { return x.dot(P * x); }
};

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
