// Symbols as in pendulum/equations.h; Q1 and Q2 are the torques of a push at both joints (N·m).
#include "web/wasm/step.h"

#include <algorithm>
#include <cmath>

#include "pendulum/equations.h"
#include "pendulum/runge_kutta.h"

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

}  // namespace

PendulumState Step(const Plant& plant, const PendulumState& s, double tau, const Push& push,
                   double h) {
  const Manipulator manipulator = ManipulatorOf(plant);
  Forces forces{plant, std::clamp(tau, -plant.torque_limit, plant.torque_limit), push, 0};
  if (push.link != 0) {
    const double length = push.link == 1 ? plant.length1 : plant.length2;
    forces.moment = Arm(AngleOf(s, push.link), push.along - length / 2).Torque(push);
  }
  const auto acceleration = [&](const PendulumState& at, double /*share*/) {
    return manipulator.Acceleration(at, forces.At(at));
  };
  return RungeKuttaStep(s, acceleration(s, 0), h, acceleration);
}

}  // namespace upswing
