#pragma once

#include "apps/rollout.h"
#include "report/figure.h"

/// What `plot` draws of one episode; the rollout has Q-values.
namespace upswing {

/// Angles, velocities, energy, torque, the reward's terms and the Q-values over time.
Figure EpisodeFigure(const Rollout& rollout, const Policy& policy);

/// Velocity over angle of both joints.
Figure PhaseFigure(const Rollout& rollout);

}  // namespace upswing
