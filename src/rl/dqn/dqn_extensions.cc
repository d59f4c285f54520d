// Extensions of DQN: mirrored targets, reward centering and an averaged policy. Symbols: see
// rl/dqn/dqn.h.
#include <algorithm>

#include "rl/dqn/dqn.h"

namespace upswing {

// The true values at σs' equal those at s'. Their errors are nearly independent, as in Double
// Q-learning (van Hasselt, 2010).
void Dqn::ForwardMirrored(Matrix<const float> s, RowRange rows, Matrix<float> q) {
  const Matrix<float> mirrored(mirrored_, B_, D_);
  for (int i = rows.first; i < rows.first + rows.count; ++i) {
    for (int k = 0; k < D_; ++k) mirrored(i, k) = mirror_signs_[k] * s(i, k);
  }
  online_.Forward(theta_target_, mirrored, rows, q);
  // Reversing the columns mirrors the torques, because they ascend and are symmetric about 0.
  for (int i = rows.first; i < rows.first + rows.count; ++i) std::ranges::reverse(q.row(i));
}

void Dqn::CenterValues(const Minibatch& batch) {
  double errors = 0;
  for (int i = 0; i < B_; ++i) errors += double{batch.weight[i]} * HuberGradient(td_error_[i]);
  const float shift = CenteringShift(batch, errors);
  for (const std::span<float> theta : {online_.mutable_theta(), std::span<float>(theta_target_),
                                       std::span<float>(theta_policy_)}) {
    online_.network().ShiftOutputs(shift, theta);
  }
}

void Dqn::AveragePolicy() {
  const auto tau = static_cast<float>(AveragingTau(config_.policy_tau));
  const std::span<const float> theta = online_.theta();
  for (size_t i = 0; i < theta.size(); ++i) {
    theta_policy_[i] += tau * (theta[i] - theta_policy_[i]);
  }
}

}  // namespace upswing
