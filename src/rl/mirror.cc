#include "rl/mirror.h"

namespace upswing {

void MirrorHalf(Rng& rng, std::span<const float> signs, const ActionSpace& actions,
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
