#pragma once

#include "base/rng.h"
#include "pendulum/plant.h"

namespace upswing {

/// Distribution of start states. A share of the episodes begins in a random state. The others begin
/// hanging, with normal noise on all four state variables.
struct StartStates {
  double noise = 0.1;          // standard deviation, rad and rad/s
  double random_share = 0;     // share of episodes that begin in a random state
  double random_velocity = 5;  // bound of the uniform velocities of random states, rad/s
  // With a time (s), random states are those where DriveToPose ends, and not uniform.
  double random_drive = 0;

  PendulumState Hanging(Rng& rng) const;
  /// Angles are in [-π, π].
  PendulumState Random(const Plant& plant, Rng& rng) const;
};

/// The state after motors at both joints have driven the links for `seconds` from upright towards a
/// random pose. Before, joint 2 has turned up to twice. Each motor has the plant's torque limit and
/// the gains of RealAIGym's resets, and holds its share of gravity besides.
PendulumState DriveToPose(const Plant& plant, double seconds, Rng& rng);

}  // namespace upswing
