// Metrics, exported policy and state of a PPO agent.
#include <algorithm>
#include <limits>
#include <numeric>

#include "base/text.h"
#include "nn/gaussian.h"
#include "nn/network_policy.h"
#include "rl/ppo/ppo.h"

namespace upswing {
namespace {

/// Parameters that act on raw observations as `weights` act on normalised observations, computed in
/// double. In the first layer, x̂ W + b = x (W / σ) + (b - (μ / σ) W).
AlignedVector<float> WithNormalizer(const Network& network, std::span<const float> weights,
                                    const Normalizer& normalizer) {
  AlignedVector<float> folded(weights.begin(),
                              weights.begin() + static_cast<ptrdiff_t>(network.num_parameters()));
  const ParameterBlock& W_block = network.blocks()[0];
  const ParameterBlock& b_block = network.blocks()[1];
  const Matrix<float> W(folded.data() + W_block.offset, W_block.in, W_block.out);
  const std::vector<double> deviation = normalizer.deviation();
  for (int j = 0; j < W.cols(); ++j) {
    float& b = folded[b_block.offset + j];
    double shifted = b;
    for (int k = 0; k < W.rows(); ++k) {
      const auto input = static_cast<size_t>(k);
      const double scaled = W(k, j) / deviation[input];
      shifted -= scaled * normalizer.mean()[input];
      W(k, j) = static_cast<float>(scaled);
    }
    b = static_cast<float>(shifted);
  }
  return folded;
}

/// Parameters of an actor with outputs (μ, ln σ). ln σ is constant: its weights are 0 and its
/// biases are `log_std`. The output layer is the last layer.
AlignedVector<float> WithLogStd(const Network& network, const AlignedVector<float>& weights,
                                std::span<const float> log_std) {
  const ParameterBlock& W_block = network.blocks()[network.blocks().size() - 2];
  const Matrix<const float> W(weights.data() + W_block.offset, W_block.in, W_block.out);
  AlignedVector<float> both(weights.begin(),
                            weights.begin() + static_cast<ptrdiff_t>(W_block.offset));
  for (int k = 0; k < W.rows(); ++k) {
    both.insert(both.end(), W.row(k).begin(), W.row(k).end());
    both.insert(both.end(), log_std.size(), 0.0F);
  }
  both.insert(both.end(), weights.end() - W_block.out, weights.end());
  both.insert(both.end(), log_std.begin(), log_std.end());
  return both;
}

}  // namespace

Metrics Ppo::TakeMetrics() {
  const double n = static_cast<double>(std::max<int64_t>(1, report_updates_));
  Metrics metrics{
      {"updates", static_cast<double>(updates_)}, {"learning_rate", learning_rate()},
      {"policy_loss", report_.policy_loss / n},   {"value_loss", report_.value_loss / n},
      {"entropy", report_.entropy / n},           {"kl", report_.kl / n},
      {"clip_share", report_.clipped / n},        {"explained_variance", explained_variance_},
      {"gradient_norm", report_.norm / n}};
  if (!std_.empty()) {
    const double sum = std::accumulate(std_.begin(), std_.end(), 0.0);
    metrics.emplace_back("std", sum / static_cast<double>(std_.size()));
  }
  reported_ = true;
  return metrics;
}

void Ppo::BeginSums() {
  if (!reported_) return;
  report_ = {};
  report_updates_ = 0;
  reported_ = false;
}

std::unique_ptr<NetworkPolicy> Ppo::ExportPolicy(PolicyInfo info) const {
  info.gamma = config_.gamma;
  info.reward_scale = config_.reward_scale;
  NetworkPolicyParts parts;
  parts.rule = config_.discrete() ? ActionRule::kCategorical : ActionRule::kClippedGaussian;
  parts.shape = config_.Shape(D_, config_.discrete() ? outputs() : 2 * outputs());
  parts.critic = config_.Shape(D_, 1);
  parts.parameters = WithNormalizer(actor_.network(), actor_.theta(), normalizer_);
  if (!config_.discrete()) {
    parts.parameters = WithLogStd(actor_.network(), parts.parameters, log_std_);
  }
  parts.critic_parameters = WithNormalizer(critic_.network(), critic_.theta(), normalizer_);
  parts.action_limit = limit_;
  parts.torques = torques_;
  return std::make_unique<NetworkPolicy>(std::move(parts), std::move(info));
}

int64_t Ppo::updates_due() const {
  const int64_t updates = config_.epochs * rollout_.size() / config_.batch;
  return steps_ / rollout_.size() * updates;
}

void Ppo::State(const Archive& archive) {
  constexpr double kLargest = std::numeric_limits<double>::max();
  actor_.State(archive.In("actor"));
  critic_.State(archive.In("critic"));
  archive.Array("log_std", std::span(log_std_), {kLogStdLow, kLogStdHigh});
  log_std_adam_.State(archive.In("log_std_adam"));
  SetStd();
  normalizer_.State(archive.In("normalizer"));
  archive.Scalar("rate_factor", rate_factor_, kRateFactor);
  for (size_t i = 0; i < explore_rngs_.size(); ++i) {
    explore_rngs_[i].State(archive.In(Concat("explore_rng.", i)));
  }
  shuffle_rng_.State(archive.In("shuffle_rng"));
  mirror_rng_.State(archive.In("mirror_rng"));
  rollout_.State(archive.In("rollout"));

  // The order must be a permutation; the next epoch shuffles it further.
  archive.Array("order", std::span(order_), {0, rollout_.size() - 1});
  std::vector<int64_t> sorted(order_);
  std::ranges::sort(sorted);
  archive.Check(std::ranges::adjacent_find(sorted) == sorted.end(), "order",
                "each row of a rollout once");

  archive.Scalar("steps", steps_, {0, kMostSteps});
  archive.Check(steps_ % rollout_.size() == rollout_.filled() * rollout_.num_envs(), "steps",
                "whole rollouts and the steps of the running one");
  archive.Scalar("updates", updates_, {0, std::numeric_limits<int64_t>::max()});
  archive.Check(updates_ == updates_due() && actor_.steps() == updates_ &&
                    critic_.steps() == updates_ && log_std_adam_.steps() == updates_,
                "updates", Concat(updates_due(), ", which the steps imply, and as many of Adam"));
  archive.Scalar("report_updates", report_updates_, {0, updates_});
  archive.Scalar("reported", reported_);
  archive.Scalar("policy_loss_sum", report_.policy_loss, kAnyNumber<double>);
  archive.Scalar("value_loss_sum", report_.value_loss, {0, kLargest});
  archive.Scalar("entropy_sum", report_.entropy, kAnyNumber<double>);
  archive.Scalar("kl_sum", report_.kl, kAnyNumber<double>);
  archive.Scalar("clipped_sum", report_.clipped, {0, kLargest});
  archive.Scalar("norm_sum", report_.norm, {0, kLargest});
  archive.Scalar("explained_variance", explained_variance_, {-kLargest, 1});
}

}  // namespace upswing
