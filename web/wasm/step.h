#pragma once

#include "pendulum/plant.h"

namespace upswing {

/// A force on the pendulum.
struct Push {
  int link = 0;         // 1 or 2; 0: no force
  double along = 0;     // distance of its point from the link's hinge, m
  double x = 0, z = 0;  // N; x to the right, z up
};

/// One classical Runge-Kutta step of h seconds under the motor's torque tau (N·m) and a push.
/// MuJoCo takes a push as this does: the force moves with the link's centre, and its torque about
/// the centre stays that at the step's beginning.
PendulumState Step(const Plant& plant, const PendulumState& s, double tau, const Push& push,
                   double h);

}  // namespace upswing
