#pragma once

#include "sim/double_pendulum.h"

namespace upswing {

/// What decides whether one motor can hold both links upright.
struct UprightModes {
  double faster, slower;  // rates of growth of the two unstable modes, 1/s
  double decay;           // rate of the mode that decays fastest, 1/s
  double pole;            // at which link 2 alone falls, its joint held still, 1/s
  // (z - pole) / (z + pole) with the zero z of link 2's answer to the motion of link 1. At 0
  // damping of joint 2 cancels the inertial coupling of the links just for that mode, which then
  // cannot be controlled; the gain grows as 1/|delta|. The standard plant has -0.40.
  double delta;
};

UprightModes ModesOf(const Plant& plant);

}  // namespace upswing
