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
  // With a time (s), a random state is where DriveToPose ends, from the last episode's end.
  double random_drive = 0;

  PendulumState Hanging(Rng& rng) const;
  /// `last`: the state in which the episode before ended; hanging before the first.
  PendulumState Random(const Plant& plant, const PendulumState& last, Rng& rng) const;
};

/// The state after motors at both joints have driven the links from `s` towards a random pose for
/// `seconds`, as RealAIGym's resets do. Each motor has the plant's torque limit, and holds the
/// links against gravity besides. A joint that has turned is turned back, as if it had turned at
/// most 2.5 times. A state that has blown up counts as hanging.
PendulumState DriveToPose(const Plant& plant, PendulumState s, double seconds, Rng& rng);

}  // namespace upswing
