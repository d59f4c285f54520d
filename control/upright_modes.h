#pragma once

#include "sim/double_pendulum.h"

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

UprightModes ModesOf(const Plant& plant);

}  // namespace upswing
