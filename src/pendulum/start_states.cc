#include "pendulum/start_states.h"

#include <algorithm>
#include <array>
#include <cmath>
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

PendulumState StartStates::Random(const Plant& plant, const PendulumState& last, Rng& rng) const {
  if (random_drive > 0) return DriveToPose(plant, last, random_drive, rng);
  return {rng.Uniform(-kPi, kPi), rng.Uniform(-kPi, kPi),
          rng.Uniform(-random_velocity, random_velocity),
          rng.Uniform(-random_velocity, random_velocity)};
}

PendulumState DriveToPose(const Plant& plant, PendulumState s, double seconds, Rng& rng) {
  constexpr double kStep = 0.002;                                         // s
  constexpr double kAngle = 10, kVelocity = 2;                            // N·m/rad, N·m·s/rad
  constexpr double kTurns = 5, kFastest = 1e3;                            // rad/s
  if (!(std::abs(s.w1) < kFastest && std::abs(s.w2) < kFastest)) s = {};  // blown up
  s.q1 = std::remainder(s.q1, kTurns * 2 * kPi);
  s.q2 = std::remainder(s.q2, kTurns * 2 * kPi);
  const Manipulator body = ManipulatorOf(plant);
  const double limit = plant.torque_limit;
  const std::array<double, 2> pose{rng.Uniform(-kPi, kPi), rng.Uniform(-kPi, kPi)};
  for (double time = 0; time < seconds - kStep / 2; time += kStep) {
    const ManipulatorTerms held = body.At({s.q1, s.q2, 0, 0});
    const std::array<double, 2> torque{
        std::clamp(kAngle * (pose[0] - s.q1) - kVelocity * s.w1, -limit, limit) + held.h1,
        std::clamp(kAngle * (pose[1] - s.q2) - kVelocity * s.w2, -limit, limit) + held.h2};
    const auto acceleration = [&](const PendulumState& at, double /*share*/) {
      return body.Acceleration(at, torque);
    };
    s = RungeKuttaStep(s, acceleration(s, 0), kStep, acceleration);
  }
  return s;
}

}  // namespace upswing
