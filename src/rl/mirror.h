#pragma once

#include <span>

#include "base/rng.h"
#include "rl/action_space.h"
#include "rl/replay.h"

namespace upswing {

/// Mirrors a random half of a minibatch. Observations are multiplied by `signs` (D). An action is
/// reflected at the middle of its bounds, so that its torque changes sign.
void MirrorHalf(Rng& rng, std::span<const float> signs, const ActionSpace& actions,
                Minibatch& batch);

}  // namespace upswing
