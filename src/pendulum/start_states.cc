#include "pendulum/start_states.h"

#include <algorithm>
#include <array>
#include <numbers>

#include "pendulum/equations.h"
#include "pendulum/runge_kutta.h"

namespace upswing {
namespace {

constexpr double kPi = std::numbers::pi;

}  // namespace

PendulumState StartStates::Hanging(Rng& rng) const {
  return {noise * rng.Normal(), noise * rng.Normal(), noise * rng.Normal(), noise * rng.Normal()};
}

PendulumState StartStates::Random(const Plant& plant, Rng& rng) const {
  if (random_drive > 0) return DriveToPose(plant, random_drive, rng);
  return {rng.Uniform(-kPi, kPi), rng.Uniform(-kPi, kPi),
          rng.Uniform(-random_velocity, random_velocity),
          rng.Uniform(-random_velocity, random_velocity)};
}

PendulumState DriveToPose(const Plant& plant, double seconds, Rng& rng) {
  constexpr double kStep = 0.002;               // s
  constexpr double kAngle = 10, kVelocity = 2;  // N·m/rad, N·m·s/rad
  const Manipulator body = ManipulatorOf(plant);
  const double limit = plant.torque_limit;
  PendulumState s{rng.Below(2) == 0 ? kPi : -kPi,
                  2 * kPi * (static_cast<double>(rng.Below(5)) - 2)};
  const std::array<double, 2> pose{rng.Uniform(-kPi, kPi), rng.Uniform(-kPi, kPi)};
  for (double time = 0; time < seconds - kStep / 2; time += kStep) {
    const ManipulatorTerms gravity = body.At({s.q1, s.q2, 0, 0});
    const std::array<double, 2> torque{
        std::clamp(kAngle * (pose[0] - s.q1) - kVelocity * s.w1, -limit, limit) + gravity.h1,
        std::clamp(kAngle * (pose[1] - s.q2) - kVelocity * s.w2, -limit, limit) + gravity.h2};
    const auto acceleration = [&](const PendulumState& at, double /*share*/) {
      return body.Acceleration(at, torque);
    };
    s = RungeKuttaStep(s, acceleration(s, 0), kStep, acceleration);
  }
  return {Wrapped(s.q1), Wrapped(s.q2), s.w1, s.w2};
}

}  // namespace upswing
