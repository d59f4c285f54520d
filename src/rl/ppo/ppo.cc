// Proximal policy optimisation (Schulman et al., 2017). Symbols: s observation, a action, r ratio
// π(a|s)/π_old(a|s), A advantage, V value, R its target, N environments, T steps of a rollout, B
// batch size, D observation size, A number of torques, K number of levels.
#include "rl/ppo/ppo.h"

#include <algorithm>
#include <cmath>
#include <numeric>

#include "nn/orthogonal.h"
#include "rl/ppo/action_distribution.h"
#include "rl/ppo/advantages.h"
#include "rl/replay/mirror.h"
#include "rl/torque_levels.h"

namespace upswing {
namespace {

constexpr int kActRows = 32;           // environments per acting task
constexpr double kAdamEpsilon = 1e-5;  // Andrychowicz et al. (2021)
constexpr double kOutputGain = 0.01;   // gain of the actor's output layer: actions begin near 0
constexpr double kRateStep = 1.5;      // factor by which the KL target changes the learning rate

int Blocks(int num_envs) { return (num_envs + kActRows - 1) / kActRows; }

}  // namespace

Ppo::Ppo(const PpoConfig& config, const EnvSpec& spec, uint64_t seed, ThreadPool& pool)
    : config_(config),
      D_(spec.obs_size),
      B_(static_cast<int>(config.batch)),
      limit_(spec.action_limit),
      torques_(config.discrete() ? ActionTable(spec, config.levels, "actions = levels")
                                 : std::vector<double>()),
      mirror_signs_(spec.mirror_signs),
      pool_(pool),
      update_threads_(&pool),
      shuffle_rng_(seed, "minibatches"),
      mirror_rng_(seed, "mirror"),
      actor_(config.Shape(D_, outputs()), B_, kAdamEpsilon),
      critic_(config.Shape(D_, 1), B_, kAdamEpsilon),
      log_std_(config.discrete() ? 0 : limit_.size(),
               static_cast<float>(std::log(config.initial_std))),
      std_(log_std_.size()),
      log_std_adam_(log_std_.size(), kAdamEpsilon),
      normalizer_(D_),
      rollout_(config.horizon, spec.num_envs, D_,
               config.discrete() ? ActionSpace::Discrete(torques_.size())
                                 : ActionSpace{spec.action_size(), kAnyNumber<float>}),
      order_(rollout_.size()),
      value_(order_.size()),
      next_value_(order_.size()),
      advantage_(order_.size()),
      target_(order_.size()),
      act_activations_(actor_.network().MakeActivations(spec.num_envs, false)),
      act_obs_(spec.num_envs * D_),
      act_outputs_(spec.num_envs * outputs()),
      obs_(B_ * D_),
      action_(static_cast<size_t>(B_) * limit_.size()),
      y_(B_ * outputs()),
      dy_(y_.size()),
      V_(B_),
      dV_(V_.size()),
      old_log_prob_(V_.size()),
      old_value_(old_log_prob_.size()),
      batch_advantage_(old_log_prob_.size()),
      batch_target_(old_log_prob_.size()),
      mirrored_(old_log_prob_.size()),
      sums_(static_cast<size_t>(NumSlices(B_))) {
  CheckMirror(config.mirror, spec);
  for (int block = 0; block < Blocks(spec.num_envs); ++block) {
    explore_rngs_.emplace_back(seed, "exploration", static_cast<uint64_t>(block));
  }
  std::iota(order_.begin(), order_.end(), 0);
  Rng init_rng(seed, "initial parameters");
  InitializeOrthogonal(actor_.network(), kOutputGain, init_rng, actor_.mutable_theta());
  InitializeOrthogonal(critic_.network(), 1, init_rng, critic_.mutable_theta());
  SetStd();
}

int Ppo::outputs() const {
  return static_cast<int>(config_.discrete() ? torques_.size() : limit_.size());
}

void Ppo::SetStd() {
  for (size_t k = 0; k < std_.size(); ++k) {
    log_std_[k] =
        std::clamp(log_std_[k], float{kLogStdLow}, static_cast<float>(std::log(config_.max_std)));
    std_[k] = std::exp(log_std_[k]);
  }
}

void Ppo::Act(Matrix<const float> obs, Matrix<double> action) {
  const int N = obs.rows();
  const Matrix<float> normal(act_obs_, N, D_);
  const Matrix<float> y(act_outputs_, N, outputs());
  std::ranges::copy(obs.values(), rollout_.obs().values().begin());
  pool_.ParallelFor(Blocks(N), [&](int block) {
    const RowRange rows{block * kActRows, std::min(kActRows, N - block * kActRows)};
    for (int i = rows.first; i < rows.first + rows.count; ++i) {
      normalizer_.Apply(obs.row(i), normal.row(i));
    }
    actor_.network().Forward(actor_.theta(), normal, rows, act_activations_, y);
    Sample(rows, y, explore_rngs_[block], action);
  });
}

void Ppo::Sample(RowRange rows, Matrix<const float> outputs, Rng& rng, Matrix<double> action) {
  const Matrix<float> stored = rollout_.action();
  const std::span<float> log_prob = rollout_.log_prob();
  AlignedVector<float> p(torques_.size());
  for (int i = rows.first; i < rows.first + rows.count; ++i) {
    if (config_.discrete()) {
      const Categorical<float> policy(outputs.row(i), p);
      const size_t level = policy.Sample(rng);
      stored(i, 0) = static_cast<float>(level);
      log_prob[i] = policy.LogProb(level);
      action(i, 0) = torques_[level];
    } else {
      const DiagonalGaussian<float> policy{outputs.row(i), log_std_, std_};
      policy.Sample(rng, stored.row(i));
      log_prob[i] = policy.LogProb(stored.row(i));
      // The environment gets the clamped action. π refers to the action as drawn.
      for (int k = 0; k < stored.cols(); ++k) {
        action(i, k) = limit_[k] * std::clamp(stored(i, k), -1.0F, 1.0F);
      }
    }
  }
}

void Ppo::Observe(const StepResult& result) {
  rollout_.Add(result, config_.reward_scale);
  steps_ += rollout_.num_envs();
}

void Ppo::Values(Matrix<const float> obs, std::span<float> values) {
  for (int first = 0; first < obs.rows(); first += B_) {
    const int count = std::min(B_, obs.rows() - first);
    const Matrix<float> s = BatchObs();
    const Matrix<float> V(values.data() + first, count, 1);
    ForSlices(pool_, count, [&](RowRange rows) {
      for (int i = rows.first; i < rows.first + rows.count; ++i) {
        normalizer_.Apply(obs.row(first + i), s.row(i));
      }
      critic_.Forward(s, rows, V);
    });
  }
}

void Ppo::Estimate() {
  const int T = static_cast<int>(config_.horizon), N = rollout_.num_envs();
  Values(rollout_.all_obs(), value_);

  // The successor's value is the value of the next row, except where an episode or the rollout
  // ends.
  const Matrix<const uint8_t> terminated = rollout_.terminated(), truncated = rollout_.truncated();
  std::vector<int> ends;
  std::vector<float> end_obs;
  for (int t = 0; t < T; ++t) {
    for (int i = 0; i < N; ++i) {
      const int row = t * N + i;
      const bool needed = terminated(t, i) == 0 && (truncated(t, i) != 0 || t == T - 1);
      if (needed) {
        ends.push_back(row);
        const std::span<const float> obs = rollout_.all_next_obs().row(row);
        end_obs.insert(end_obs.end(), obs.begin(), obs.end());
      }
      next_value_[row] = t < T - 1 ? value_[row + N] : 0;
    }
  }
  std::vector<float> end_value(ends.size());
  Values({end_obs.data(), static_cast<int>(ends.size()), D_}, end_value);
  for (size_t i = 0; i < ends.size(); ++i) next_value_[ends[i]] = end_value[i];

  GeneralizedAdvantages({rollout_.rewards(),
                         {value_.data(), T, N},
                         {next_value_.data(), T, N},
                         terminated,
                         truncated},
                        config_.gamma, config_.lambda, {advantage_.data(), T, N});
  for (size_t i = 0; i < target_.size(); ++i) target_[i] = advantage_[i] + value_[i];
  explained_variance_ = ExplainedVariance(target_, value_);
}

void Ppo::Learn() {
  if (!rollout_.full()) return;
  BeginSums();
  Estimate();
  double kl = 0;
  for (int64_t epoch = 0; epoch < config_.epochs; ++epoch) {
    // Shuffle a whole epoch (Fisher and Yates).
    for (size_t i = order_.size(); i > 1; --i) {
      std::swap(order_[i - 1], order_[shuffle_rng_.Below(i)]);
    }
    const double before = report_.kl;
    for (size_t first = 0; first < order_.size(); first += static_cast<size_t>(B_)) {
      const auto rows = std::span(order_).subspan(first, B_);
      update_threads_.Run([&] { Update(rows); });
    }
    kl = (report_.kl - before) * static_cast<double>(B_) / static_cast<double>(order_.size());
  }
  AdaptRate(kl);
  // Update the statistics after the epochs, because the old and new probabilities of a rollout need
  // the same statistics.
  if (config_.normalize) normalizer_.Add(rollout_.all_obs());
  rollout_.Clear();
}

void Ppo::AdaptRate(double kl) {
  if (config_.kl_target == 0) return;
  if (kl > 2 * config_.kl_target) rate_factor_ /= kRateStep;
  if (kl < config_.kl_target / 2) rate_factor_ *= kRateStep;
  rate_factor_ = std::clamp(rate_factor_, kRateFactor.lowest, kRateFactor.highest);
}

}  // namespace upswing
