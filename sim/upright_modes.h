#pragma once

#include <array>

#include "sim/manipulator.h"

namespace upswing {

/// What decides whether one motor can hold both links upright.
struct UprightModes {
  double faster, slower;  // rates of growth of the two unstable modes, 1/s
  double decay;           // rate of the mode that decays fastest, 1/s
  // At which the joint without a motor falls while the other is held still, 1/s.
  double pole;
  // (z - pole) / (z + pole) with the zero z of that joint's answer to the motion of the other. At 0
  // the two cancel: its damping takes up the coupling of the links just for that mode, which then
  // cannot be controlled; the gain grows as 1/|delta|. The standard plant has -0.40, and -0.035
  // with the motor at joint 2.
  double delta;
};

/// Dry friction is left out, as in LinearizeUpright.
UprightModes ModesOf(const Manipulator& plant, int actuated_joint);
UprightModes ModesOf(const Plant& plant);

/// How the pendulum falls from upright. Each of the two unstable modes has a coordinate z, a
/// weighted sum of the state, that moves by itself: ż = rate z + gain u. A motor of limit u* can
/// return z as long as |rate z| < gain u*; zeta = rate z / (gain u*) has this limit at 1.
struct Falling : UprightModes {
  std::array<double, 2> zeta;  // of the state, that of the faster mode first
  double torque;  // that ends both falls with the least effort ∫u² dt, over the limit u*
};

/// `motor` gives the joint and the limit of the torque.
Falling FallingOf(const Manipulator& plant, const Plant& motor, const PendulumState& s);

}  // namespace upswing
