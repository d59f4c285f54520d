#pragma once

#include "base/rng.h"
#include "pendulum/scale.h"

namespace upswing {

/// Distribution of start states. A share of the episodes begins in a random state. The others begin
/// hanging, with normal noise on all four state variables.
struct StartStates {
  double noise = 0.1;          // standard deviation, rad and rad/s of the built-in plant
  double random_share = 0;     // share of episodes that begin in a random state
  double random_velocity = 5;  // bound of the uniform velocities of random states, rad/s
  // Seconds of DriveToPose before each random start, which then replaces uniform angles and
  // velocities; 0: none.
  double random_drive = 0;

  /// Velocities are in units of `scale`.
  PendulumState Hanging(const Scale& scale, Rng& rng) const;
  /// `last`: the state at the end of the episode before; hanging before the first.
  PendulumState Random(const Plant& plant, const PendulumState& last, Rng& rng) const;
};

/// The state after motors at both joints have driven the links for `seconds` towards a random pose
/// in [-π, π]. Proportional and derivative torques stay within the plant's torque limit; the torque
/// that holds the links against gravity comes on top. The gains in units of the limit are those of
/// RealAIGym's resets (docs/howto/realaigym.md), without the integral.
///
/// Angles are not wrapped: a joint that has turned is turned back. Five turns count as none. Before
/// and after the drive, hanging at rest replaces a state with |w1| + |w2| beyond 200 rad/s.
PendulumState DriveToPose(const Plant& plant, const PendulumState& from, double seconds, Rng& rng);

}  // namespace upswing
