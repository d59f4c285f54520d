// Symbols as in pendulum/equations.h; Q1 and Q2 are the torques of a push at both joints (N·m).
#include "web/wasm/step.h"

#include <algorithm>
#include <cmath>

#include "pendulum/equations.h"

namespace upswing {
namespace {

/// From a link's hinge to a point along it, m. A positive angle turns it to -x.
struct Arm {
  Arm(double angle, double along) : x(-along * std::sin(angle)), z(-along * std::cos(angle)) {}

  /// The torque (N·m) of a force at its end; positive like the joints' angles.
  double Torque(const Push& push) const { return z * push.x - x * push.z; }

  double x, z;
};

double AngleOf(const PendulumState& s, int link) { return link == 1 ? s.q1 : s.q1 + s.q2; }

/// The forces on the pendulum during one step.
struct Forces {
  const Plant& plant;
  double tau;
  const Push& push;
  double moment;  // of the push about its link's centre, N·m

  std::array<double, 2> At(const PendulumState& s) const {
    if (push.link == 0) return {tau, 0};
    const double length = push.link == 1 ? plant.length1 : plant.length2;
    const double Q = moment + Arm(AngleOf(s, push.link), length / 2).Torque(push);
    if (push.link == 1) return {tau + Q, 0};
    return {tau + Q + Arm(s.q1, plant.length1).Torque(push), Q};
  }
};

/// The state after h seconds with these velocities and accelerations.
PendulumState Plus(const PendulumState& s, double h, const std::array<double, 2>& w,
                   const std::array<double, 2>& a) {
  return {s.q1 + h * w[0], s.q2 + h * w[1], s.w1 + h * a[0], s.w2 + h * a[1]};
}

}  // namespace

PendulumState Step(const Plant& plant, const PendulumState& s, double tau, const Push& push) {
  const Manipulator manipulator = ManipulatorOf(plant);
  Forces forces{plant, std::clamp(tau, -plant.torque_limit, plant.torque_limit), push, 0};
  if (push.link != 0) {
    const double length = push.link == 1 ? plant.length1 : plant.length2;
    forces.moment = Arm(AngleOf(s, push.link), push.along - length / 2).Torque(push);
  }
  const auto acceleration = [&](const PendulumState& at) {
    return manipulator.Acceleration(at, forces.At(at));
  };
  constexpr double h = kPhysicsTimestep;
  const auto a1 = acceleration(s);
  const PendulumState s2 = Plus(s, h / 2, {s.w1, s.w2}, a1);
  const auto a2 = acceleration(s2);
  const PendulumState s3 = Plus(s, h / 2, {s2.w1, s2.w2}, a2);
  const auto a3 = acceleration(s3);
  const PendulumState s4 = Plus(s, h, {s3.w1, s3.w2}, a3);
  const auto a4 = acceleration(s4);
  const auto mean = [](double k1, double k2, double k3, double k4) {
    return (k1 + 2 * k2 + 2 * k3 + k4) / 6;
  };
  return Plus(s, h, {mean(s.w1, s2.w1, s3.w1, s4.w1), mean(s.w2, s2.w2, s3.w2, s4.w2)},
              {mean(a1[0], a2[0], a3[0], a4[0]), mean(a1[1], a2[1], a3[1], a4[1])});
}

}  // namespace upswing
