#pragma once

#include <span>

#include "base/env.h"
#include "base/error.h"
#include "base/rng.h"
#include "base/text.h"
#include "rl/replay/action_space.h"
#include "rl/replay/replay.h"

namespace upswing {

/// Throws BadInput if minibatches are mirrored but the task has no mirror symmetry.
inline void CheckMirror(bool mirror, const EnvSpec& spec) {
  if (!mirror || !spec.mirror_signs.empty()) return;
  throw BadInput(Concat("mirror: expected a task with mirror symmetry, got ", spec.task));
}

/// Mirrors a random half of a minibatch. Observations are multiplied by `signs` (D). An action is
/// reflected at the middle of its bounds, so that its torque changes sign.
inline void MirrorHalf(Rng& rng, std::span<const float> signs, const ActionSpace& actions,
                       Minibatch& batch) {
  const size_t D = signs.size();
  const auto A = static_cast<size_t>(actions.size);
  const float sum = actions.bounds.lowest + actions.bounds.highest;
  for (size_t i = 0; i < batch.reward.size(); ++i) {
    if (rng.Below(2) == 0) continue;
    for (size_t j = 0; j < D; ++j) {
      batch.obs[i * D + j] *= signs[j];
      batch.next_obs[i * D + j] *= signs[j];
    }
    for (float& a : std::span(batch.action).subspan(i * A, A)) a = sum - a;
  }
}

}  // namespace upswing
