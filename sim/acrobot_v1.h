#pragma once

#include "sim/gym_task.h"

namespace upswing {

inline constexpr const char* kAcrobotV1 = "acrobot-v1";

/// Gymnasium's Acrobot-v1: two links with a motor between them swing the free end above a line.
/// https://gymnasium.farama.org/environments/classic_control/acrobot/
///
/// State: theta1, the angle of the first link, 0 hanging, and theta2, that of the second relative
/// to the first, both in [-π, π], rad; omega1 within ±4π and omega2 within ±9π, rad/s. Action:
/// torque u within ±1 N·m at the second joint, applied as it is; Gymnasium's are -1, 0 and 1.
///
/// | index | observation | range     | unit  |
/// |-------|-------------|-----------|-------|
/// | 0     | cos theta1  | -1 to 1   | 1     |
/// | 1     | sin theta1  | -1 to 1   | 1     |
/// | 2     | cos theta2  | -1 to 1   | 1     |
/// | 3     | sin theta2  | -1 to 1   | 1     |
/// | 4     | omega1      | -4π to 4π | rad/s |
/// | 5     | omega2      | -9π to 9π | rad/s |
///
/// The links are 1 m long, of 1 kg, with moments of inertia of 1 kg·m² about their middles; g =
/// 9.8 m/s². A step is one of the classical Runge-Kutta method over 0.2 s, by the equations of the
/// book (Sutton and Barto, Reinforcement Learning, 1998, Section 11.3), Gymnasium's default; then
/// angles are wrapped and velocities clipped. Reward: "time", -1 a step, and 0 for the one that
/// terminates.
///
/// An episode begins with all four variables within ±0.1, uniformly. It terminates at the goal, the
/// free end more than 1 m above the first joint, -cos theta1 - cos(theta1 + theta2) > 1, and is
/// truncated after 500 steps. An evaluation judges the return of a whole episode; Gymnasium's
/// threshold is -100, in the mean over the starts.
class AcrobotV1 final : public GymTask {
 public:
  explicit AcrobotV1(const GymTaskConfig& config);

 private:
  void Move(Matrix<double> states, std::span<const double> torque,
            StepResult& result) const override;
  void Observe(Matrix<const double> states, Matrix<float> obs) const override;
};

}  // namespace upswing
