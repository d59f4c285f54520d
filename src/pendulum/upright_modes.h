#pragma once

#include <array>

#include "pendulum/equations.h"

namespace upswing {

/// The quantities that decide whether one motor can hold both links upright.
struct UprightModes {
  double faster, slower;  // rates of growth of the two unstable modes, 1/s
  // Rate at which the joint without a motor falls while the other joint is held still, 1/s.
  double pole;
  // (z - pole) / (z + pole), where z is the zero of the passive joint's response to the other
  // joint's motion. At 0, zero and pole cancel: the passive joint's damping offsets the coupling of
  // the links for this mode. The mode then cannot be controlled; the gain grows as 1/|delta|. delta
  // is -0.40 for the standard plant, and -0.035 with its motor at joint 2.
  double delta;
};

/// Leaves out dry friction, as LinearizeUpright does.
UprightModes ModesOf(const Manipulator& plant, int actuated_joint);
UprightModes ModesOf(const Plant& plant);

/// How the pendulum falls from upright. Each of the two unstable modes has a coordinate z, a
/// weighted sum of the state, that moves independently: ż = rate z + gain u. A motor with limit u*
/// can return z as long as |rate z| < gain u*. For zeta = rate z / (gain u*), this limit is 1.
struct Falling : UprightModes {
  std::array<double, 2> zeta;  // of the faster mode first
  double torque;  // torque that stops both falls with the least effort ∫u² dt, over the limit u*
};

/// `motor` gives the motor's joint and torque limit.
Falling FallingOf(const Manipulator& plant, const Plant& motor, const PendulumState& s);

}  // namespace upswing
