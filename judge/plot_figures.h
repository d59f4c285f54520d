#pragma once

#include "judge/rollout.h"
#include "report/figure.h"

/// What `plot` draws of one episode.
namespace upswing {

/// The motion, torque, the reward's terms and, as far as the policy estimates them and the rollout
/// has them, the spread of its torques and its values over time.
Figure EpisodeFigure(const Rollout& rollout, const Policy& policy);

/// Velocity over angle of both joints of the double pendulum.
Figure PhaseFigure(const Rollout& rollout);

}  // namespace upswing
