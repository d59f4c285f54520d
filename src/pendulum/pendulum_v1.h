#pragma once

#include "pendulum/gym_task.h"

namespace upswing {

inline constexpr const char* kPendulumV1 = "pendulum-v1";

/// Gymnasium's Pendulum-v1: a motor swings up a rod that it is too weak to lift in one go, and
/// balances it. https://gymnasium.farama.org/environments/classic_control/pendulum/
///
/// State: theta in [-π, π], rad, 0 upright; omega within ±8 rad/s. Gymnasium lets theta grow beyond
/// π; neither observation nor reward depends on the full turns. Action: torque u within ±2 N·m.
///
/// | index | observation | range   | unit  |
/// |-------|-------------|---------|-------|
/// | 0     | cos theta   | -1 to 1 | 1     |
/// | 1     | sin theta   | -1 to 1 | 1     |
/// | 2     | omega       | -8 to 8 | rad/s |
///
/// A step of dt = 0.05 s, with g = 10 m/s², m = 1 kg, l = 1 m (semi-implicit Euler):
///   omega' = clip(omega + (3 g / (2 l) sin theta + 3 / (m l²) u) dt, ±8)
///   theta' = theta + omega' dt
/// Reward: angle -theta², velocity -0.1 omega², torque -0.001 u², of the state before the step.
///
/// An episode begins with theta uniform within ±π and omega uniform within ±1. It is truncated
/// after 200 steps and never terminates. The goal is to be within 5° of upright. An evaluation
/// judges the return of a whole episode. Gymnasium names no threshold; here it is a mean of -160
/// over the starts. Well-trained agents such as SAC reach -145 to -157.
class PendulumV1 final : public GymTask {
 public:
  explicit PendulumV1(const GymTaskConfig& config);

  /// Writes theta, the lean of the only body.
  void Lean(int env, std::span<double> lean) const override;

 private:
  void Move(Matrix<double> states, std::span<const double> torque,
            StepResult& result) const override;
  void Observe(Matrix<const double> states, Matrix<float> obs) const override;
};

}  // namespace upswing
