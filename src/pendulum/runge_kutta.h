#pragma once

#include <array>

#include "pendulum/plant.h"

namespace upswing {

/// The state after one classical Runge-Kutta step of `h` seconds from s, with the acceleration a1
/// (rad/s²). `acceleration(state, share)` is the acceleration in a state at the fraction `share` of
/// the step, 1/2 or 1.
template <typename Acceleration>
PendulumState RungeKuttaStep(const PendulumState& s, const std::array<double, 2>& a1, double h,
                             const Acceleration& acceleration) {
  const auto after = [&](double dt, const PendulumState& rate, const std::array<double, 2>& a) {
    return PendulumState{s.q1 + dt * rate.w1, s.q2 + dt * rate.w2, s.w1 + dt * a[0],
                         s.w2 + dt * a[1]};
  };
  const PendulumState s2 = after(h / 2, s, a1);
  const std::array<double, 2> a2 = acceleration(s2, 0.5);
  const PendulumState s3 = after(h / 2, s2, a2);
  const std::array<double, 2> a3 = acceleration(s3, 0.5);
  const PendulumState s4 = after(h, s3, a3);
  const std::array<double, 2> a4 = acceleration(s4, 1.0);
  return {s.q1 + h / 6 * (s.w1 + 2 * s2.w1 + 2 * s3.w1 + s4.w1),
          s.q2 + h / 6 * (s.w2 + 2 * s2.w2 + 2 * s3.w2 + s4.w2),
          s.w1 + h / 6 * (a1[0] + 2 * a2[0] + 2 * a3[0] + a4[0]),
          s.w2 + h / 6 * (a1[1] + 2 * a2[1] + 2 * a3[1] + a4[1])};
}

}  // namespace upswing
