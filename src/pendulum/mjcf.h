#pragma once

#include <string>

#include "pendulum/plant.h"

namespace upswing {

/// The model as MJCF, with all digits of the plant's numbers. Own links have an element `inertial`
/// each. A fixed tendon of length q1 - gear_ratio q2 stands for the
/// rotor of joint 2's motor. For dry friction, each joint has its c as
/// frictionloss and its slope as user data. The frictionloss constraint is switched off;
/// mujoco/model.h adds the friction where it finds the user data.
std::string Mjcf(const Plant& plant);

}  // namespace upswing
