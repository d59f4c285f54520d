#pragma once

#include <string>

#include "pendulum/equations.h"
#include "pendulum/randomization.h"

/// The time step of the simulation against the swing and the fastest decay of a plant. A
/// Runge-Kutta step of `h` seconds is unstable for velocities that decay at more than 2.785 / h:
/// Hairer, Wanner, "Solving Ordinary Differential Equations II" (1996), section IV.2.
namespace upswing {

/// How fast friction stops the joints.
struct FastestDecay {
  double rate;     // of the fastest mode, at its worst angle of joint 2, 1/s
  int joint;       // the joint that contributes most, 1 or 2
  double inertia;  // that this joint moves there while the other joint is free, kg·m²
};

/// The fastest decay by damping and dry friction: the largest eigenvalue of M⁻¹ D over all angles.
/// Dry friction counts with its slope over a velocity of 0.2 rad/s. A steeper slope near rest only
/// makes a joint shake by less than this.
FastestDecay FastestDecayOf(const Manipulator& body);

/// Throws BadInput, with a message that begins with `where`, if Runge-Kutta steps of `h` seconds
/// are unstable for this plant.
void CheckTimestep(const Plant& plant, const std::string& where, double h);

/// Number of Runge-Kutta steps in a control period of `period` seconds that resolve the plant's
/// swing and its fastest decay: a power of 2, and kPhysicsSteps for the built-in plant. Throws
/// BadInput, with a message that begins with `where`, if more than kMostPhysicsSteps are necessary.
int PhysicsStepsFor(const Plant& plant, double period, const std::string& where);
/// The same for all plants that the box of `random` contains. A posterior is not considered.
int PhysicsStepsFor(const Plant& nominal, const Randomization& random, double period,
                    const std::string& where);
inline constexpr int kMostPhysicsSteps = 1024;

}  // namespace upswing
