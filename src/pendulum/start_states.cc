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

PendulumState StartStates::Hanging(const Scale& scale, Rng& rng) const {
  const double velocity = noise * scale.velocity();
  return {noise * rng.Normal(), noise * rng.Normal(), velocity * rng.Normal(),
          velocity * rng.Normal()};
}

PendulumState StartStates::Random(const Plant& plant, const PendulumState& last, Rng& rng) const {
  if (random_drive > 0) return DriveToPose(plant, last, random_drive, rng);
  return {rng.Uniform(-kPi, kPi), rng.Uniform(-kPi, kPi),
          rng.Uniform(-random_velocity, random_velocity),
          rng.Uniform(-random_velocity, random_velocity)};
}

PendulumState DriveToPose(const Plant& plant, const PendulumState& from, double seconds, Rng& rng) {
  constexpr double kStep = 0.002;      // s
  constexpr double kTurns = 5;         // an angle after five turns is the same
  constexpr double kFastest = 200;     // rad/s; a faster state has blown up
  constexpr double kFullError = 0.6;   // rad, at which a motor has its full torque
  constexpr double kFullVelocity = 3;  // rad/s, the same
  const auto usable = [](const PendulumState& s) {
    return std::abs(s.w1) + std::abs(s.w2) < kFastest;  // false of NaN
  };
  const Manipulator body = ManipulatorOf(plant);
  const double limit = plant.torque_limit;
  PendulumState s = usable(from) ? from : PendulumState();
  s.q1 = std::remainder(s.q1, kTurns * 2 * kPi);
  s.q2 = std::remainder(s.q2, kTurns * 2 * kPi);
  const std::array<double, 2> pose{rng.Uniform(-kPi, kPi), rng.Uniform(-kPi, kPi)};
  const auto torque = [&](double error, double w) {
    return std::clamp(limit / kFullError * error - limit / kFullVelocity * w, -limit, limit);
  };
  for (double time = 0; time < seconds - kStep / 2; time += kStep) {
    const ManipulatorTerms gravity = body.At({s.q1, s.q2, 0, 0});
    const std::array<double, 2> held{torque(pose[0] - s.q1, s.w1) + gravity.h1,
                                     torque(pose[1] - s.q2, s.w2) + gravity.h2};
    const auto acceleration = [&](const PendulumState& at, double /*share*/) {
      return body.Acceleration(at, held);
    };
    s = RungeKuttaStep(s, acceleration(s, 0), kStep, acceleration);
  }
  return usable(s) ? s : PendulumState();
}

}  // namespace upswing
