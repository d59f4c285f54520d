#pragma once

#include "pendulum/gym_task.h"

namespace upswing {

inline constexpr const char* kAcrobotV1 = "acrobot-v1";

/// Gymnasium's Acrobot-v1: a motor between two links swings the free end above a line.
/// https://gymnasium.farama.org/environments/classic_control/acrobot/
///
/// State: theta1 and theta2 in [-π, π], rad; omega1 within ±4π and omega2 within ±9π, rad/s. theta1
/// is the angle of the first link, 0 hanging. theta2 is the angle of the second link relative to
/// the first. Action: any torque u within ±1 N·m at the second joint; Gymnasium has only -1, 0 and
/// 1.
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
/// Each link is 1 m long, has a mass of 1 kg and a moment of inertia of 1 kg·m² about its middle; g
/// = 9.8 m/s². A step is one classical Runge-Kutta step over 0.2 s, with the equations of Sutton
/// and Barto, Reinforcement Learning, 1998, Section 11.3 (Gymnasium's default). After the step,
/// angles are wrapped and velocities clipped. Reward: "time", -1 for each step, and 0 for the step
/// that terminates.
///
/// An episode begins with all four variables uniform within ±0.1. It terminates at the goal: the
/// free end is more than 1 m above the first joint, -cos theta1 - cos(theta1 + theta2) > 1. It is
/// truncated after 500 steps. An evaluation judges the return of a whole episode; Gymnasium's
/// threshold is a mean of -100 over the starts.
class AcrobotV1 final : public GymTask {
 public:
  explicit AcrobotV1(const GymTaskConfig& config);

 private:
  void Move(Matrix<double> states, std::span<const double> torque,
            StepResult& result) const override;
  void Observe(Matrix<const double> states, Matrix<float> obs) const override;
};

}  // namespace upswing
