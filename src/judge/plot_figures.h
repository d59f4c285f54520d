#pragma once

#include "judge/rollout.h"
#include "report/figure.h"

/// The figures that `plot` draws of one episode.
namespace upswing {

/// Motion, torque and reward terms over time. Adds the spread of the policy's torques and its
/// values if the policy estimates them and the rollout has them.
Figure EpisodeFigure(const Rollout& rollout, const Policy& policy);

/// Phase portraits: the angle of each joint against its velocity.
Figure PhaseFigure(const Rollout& rollout);

}  // namespace upswing
