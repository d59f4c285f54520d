#pragma once

#include <array>
#include <span>

#include "core/options.h"
#include "core/policy.h"
#include "sim/double_pendulum.h"

/// The linear-quadratic regulator about upright: Anderson, Moore, "Optimal Control: Linear
/// Quadratic Methods" (1990); Tedrake, "Underactuated Robotics", chapter 8. It is the best
/// controller of the linear model; of the pendulum it is one near upright, as long as the torque is
/// within its limit.
namespace upswing {

/// What is minimised: Σ x' Q x + R u² over the control steps, x = [q1 - π, q2, w1, w2] (rad,
/// rad/s), u the torque (N·m), Q diagonal.
struct LqrConfig {
  double q1, q2;  // of Q, 1/rad²
  double w1, w2;  // of Q, s²/rad²
  double torque;  // R, 1/(N·m)²

  LqrConfig() { SetDefaults(*this); }
  /// One line per setting: name, default, range, unit, help.
  void Describe(Options& options);
};

/// The solution.
struct Lqr {
  std::array<double, 4> K;                 // gain: u = -K x, N·m/rad and N·m·s/rad
  std::array<std::array<double, 4>, 4> P;  // least cost from x: x' P x

  /// u (N·m) of a deviation x from upright.
  double Torque(const std::array<double, 4>& x) const {
    return -(K[0] * x[0] + K[1] * x[1] + K[2] * x[2] + K[3] * x[3]);
  }
};

/// Solves the problem for a plant and the control period. Throws BadInput if the plant cannot be
/// stabilised by its motor, or if no gain that these weights make stabilises it.
Lqr SolveLqr(const LqrConfig& config, const Plant& plant);

/// The deviation x = [q1 - π, q2, w1, w2] from upright that an observation of sim/double_pendulum.h
/// tells, angles in [-π, π].
std::array<double, 4> UprightDeviation(std::span<const float> obs);

/// u = -K x, at most the torque limit. It sees the angles and velocities of an observation; energy
/// and height do not matter to it.
class LqrPolicy : public Policy {
 public:
  /// Throws as SolveLqr.
  LqrPolicy(const LqrConfig& config, const Plant& plant);

  std::string kind() const override { return "lqr"; }
  std::string description() const override;
  int obs_size() const override { return kObservationSize; }
  int action_size() const override { return 1; }
  const PolicyInfo& info() const override { return info_; }
  std::unique_ptr<Memory> Start(int num_envs) const override;
  void Act(Matrix<const float> obs, Matrix<double> action, Memory& memory) const override;
  /// Throws BadInput: it is made anew each time.
  Tensors ToTensors() const override;

  const Lqr& lqr() const { return lqr_; }

 private:
  LqrConfig config_;
  Lqr lqr_;
  double torque_limit_;  // N·m
  PolicyInfo info_;
};

}  // namespace upswing
