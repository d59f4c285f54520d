// A gradient step of PPO. Symbols: see rl/ppo/ppo.h.
#include <cmath>

#include "base/error.h"
#include "base/text.h"
#include "nn/linear.h"
#include "rl/ppo/action_distribution.h"
#include "rl/ppo/advantages.h"
#include "rl/ppo/ppo.h"
#include "rl/ppo/ppo_loss.h"

namespace upswing {

void Ppo::Sums::Add(const Sums& other) {
  policy_loss += other.policy_loss;
  value_loss += other.value_loss;
  entropy += other.entropy;
  kl += other.kl;
  clipped += other.clipped;
  for (size_t k = 0; k < dlog_std.size(); ++k) dlog_std[k] += other.dlog_std[k];
}

void Ppo::Update(std::span<const int64_t> rows) {
  for (size_t i = 0; i < rows.size(); ++i) {
    batch_advantage_[i] = advantage_[rows[i]];
  }
  Standardize(batch_advantage_);
  if (config_.mirror) {
    for (uint8_t& mirrored : mirrored_) mirrored = mirror_rng_.Next() >> 63;
  }

  actor_.Prepare(pool_);
  critic_.Prepare(pool_);
  ForSlices(pool_, B_, [&](RowRange slice) {
    Sums& sums = sums_[slice.first / SliceRows(B_)];
    sums = {.dlog_std = AlignedVector<float>(std_.size())};
    Gather(rows, slice);
    BackwardActor(slice, sums);
    BackwardCritic(slice, sums);
  });
  Sums sums{.dlog_std = AlignedVector<float>(std_.size())};
  for (const Sums& part : sums_) sums.Add(part);
  CountUpdate(sums);
  Step(sums);
}

void Ppo::Step(const Sums& sums) {
  const double max_norm = config_.max_gradient_norm;
  report_.norm += actor_.Step(BatchObs(), learning_rate(), max_norm, {}, 0, pool_);
  critic_.Step(BatchObs(), scheduled_rate(), max_norm, {}, 0, pool_);
  const double norm = std::sqrt(SquaredNorm(sums.dlog_std));
  log_std_adam_.Step({learning_rate(), norm, max_norm, 0}, sums.dlog_std, log_std_, {}, pool_);
  SetStd();
  ++updates_;
  ++report_updates_;
}

void Ppo::Gather(std::span<const int64_t> from, RowRange rows) {
  const Matrix<float> s = BatchObs(), a = BatchActions();
  const Matrix<const float> all_obs = rollout_.all_obs(), all_actions = rollout_.all_actions();
  const float* log_prob = rollout_.log_probs().data();
  const auto last_level = static_cast<float>(config_.levels - 1);
  for (int i = rows.first; i < rows.first + rows.count; ++i) {
    const auto place = static_cast<size_t>(from[i]);
    const auto source = static_cast<int>(place);
    const bool mirror = mirrored_[i] != 0;
    for (int k = 0; k < D_; ++k) {
      const float sign = mirror ? mirror_signs_[k] : 1;
      s(i, k) = sign * all_obs(source, k);
    }
    normalizer_.Apply(s.row(i), s.row(i));
    for (int k = 0; k < a.cols(); ++k) a(i, k) = all_actions(source, k);
    old_log_prob_[i] = log_prob[place];
    old_value_[i] = value_[place];
    batch_target_[i] = target_[place];
    if (!mirror) continue;
    // The mirrored step has the same π_old, because it is as likely as the step itself.
    for (float& x : a.row(i)) x = config_.discrete() ? last_level - x : -x;
  }
}

void Ppo::BackwardActor(RowRange rows, Sums& sums) {
  const Matrix<const float> a = BatchActions();
  const Matrix<float> y(y_, B_, outputs()), dy(dy_, B_, outputs());
  actor_.Forward(BatchObs(), rows, y);

  // L = mean of -min(r A, clip(r) A) - c H
  const auto B = static_cast<float>(B_);
  const auto clip = static_cast<float>(config_.clip);
  const double bonus = Now(config_.entropy_bonus, config_.entropy_bonus_end);
  const float dentropy = -static_cast<float>(bonus) / B;
  AlignedVector<float> p(torques_.size());
  for (int i = rows.first; i < rows.first + rows.count; ++i) {
    const auto backward = [&](float log_prob, float entropy, const auto& gradient) {
      const float log_ratio = log_prob - old_log_prob_[i];
      const float ratio = std::exp(log_ratio);
      const LossTerm<float> term = ClippedLoss(ratio, batch_advantage_[i], clip);
      gradient(term.gradient / B);
      sums.policy_loss += term.loss;
      sums.entropy += entropy;
      sums.kl += KlEstimate(ratio, log_ratio);
      sums.clipped += std::abs(ratio - 1) > clip ? 1 : 0;
    };
    if (config_.discrete()) {
      const Categorical<float> policy(y.row(i), p);
      const auto level = static_cast<size_t>(a(i, 0));
      backward(policy.LogProb(level), policy.Entropy(),
               [&](float dlog_prob) { policy.Backward(level, dlog_prob, dentropy, dy.row(i)); });
    } else {
      const DiagonalGaussian<float> policy{y.row(i), log_std_, std_};
      backward(policy.LogProb(a.row(i)), policy.Entropy(), [&](float dlog_prob) {
        policy.Backward(a.row(i), dlog_prob, dentropy, dy.row(i), sums.dlog_std);
      });
    }
  }
  actor_.Backward(dy, rows);
}

void Ppo::BackwardCritic(RowRange rows, Sums& sums) {
  const Matrix<float> V(V_, B_, 1), dV(dV_, B_, 1);
  critic_.Forward(BatchObs(), rows, V);
  const auto clip = static_cast<float>(config_.value_clip);
  for (int i = rows.first; i < rows.first + rows.count; ++i) {
    const LossTerm<float> term = ValueLoss(V(i, 0), old_value_[i], batch_target_[i], clip);
    dV(i, 0) = term.gradient / static_cast<float>(B_);
    sums.value_loss += term.loss;
  }
  critic_.Backward(dV, rows);
}

void Ppo::CountUpdate(const Sums& sums) {
  const double B = B_;
  if (!std::isfinite(sums.policy_loss + sums.value_loss + sums.kl)) {
    throw Failure(Concat("the losses are ", sums.policy_loss / B, " and ", sums.value_loss / B,
                         ", the KL divergence ", sums.kl / B, " in update ", updates_ + 1,
                         ", expected finite numbers"));
  }
  report_.policy_loss += sums.policy_loss / B;
  report_.value_loss += sums.value_loss / B;
  report_.entropy += sums.entropy / B;
  report_.kl += sums.kl / B;
  report_.clipped += sums.clipped / B;
}

}  // namespace upswing
