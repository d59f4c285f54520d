// Proximal policy optimisation (Schulman et al., 2017). Symbols: s observation, a action, r ratio
// π(a|s)/π_old(a|s), A advantage, V value, R its target, N environments, T steps of a rollout, B
// batch size, D observation size, A number of torques, K number of levels.
#include "rl/ppo.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>

#include "core/error.h"
#include "core/text.h"
#include "nn/actor_policy.h"
#include "nn/orthogonal.h"
#include "rl/action_distribution.h"
#include "rl/advantages.h"
#include "rl/dqn.h"
#include "rl/ppo_loss.h"

namespace upswing {
namespace {

constexpr int kActRows = 32;           // environments that act in one task
constexpr double kAdamEpsilon = 1e-5;  // Andrychowicz et al. (2021)
constexpr double kOutputGain = 0.01;   // of the actor's output layer: it begins near 0
constexpr double kRateStep = 1.5;      // by which the KL target changes the learning rate…
constexpr Bounds<double> kRateFactor{1e-3, 10};  // …within this

int Blocks(int num_envs) { return (num_envs + kActRows - 1) / kActRows; }

/// The settings, if they fit such a task. Throws BadInput.
PpoConfig Checked(const PpoConfig& config, const EnvSpec& spec) {
  config.CheckBatch(spec.num_envs);
  if (config.discrete() && spec.action_size() != 1) {
    throw BadInput(Concat("actions = levels: expected a task with one torque, got ",
                          spec.action_size(), " in ", spec.task));
  }
  if (config.mirror && spec.mirror_signs.empty()) {
    throw BadInput(Concat("mirror: expected a task with mirror symmetry, got ", spec.task));
  }
  return config;
}

}  // namespace

Ppo::Learner::Learner(const MlpShape& shape, int outputs, size_t more, int batch)
    : network(shape, {outputs}),
      theta(network.num_parameters() + more),
      adam(theta.size(), kAdamEpsilon),
      activations(network.MakeActivations(batch, true)),
      prepared(network.MakePrepared(true)),
      y(static_cast<size_t>(batch) * static_cast<size_t>(outputs)),
      dy(y.size()),
      gradient(theta.size()),
      squares(static_cast<size_t>(network.num_tasks())) {}

std::span<const float> Ppo::Learner::weights() const {
  return std::span(theta).first(network.num_parameters());
}

void Ppo::Sums::Add(const Sums& other) {
  policy_loss += other.policy_loss;
  value_loss += other.value_loss;
  entropy += other.entropy;
  kl += other.kl;
  clipped += other.clipped;
  for (size_t k = 0; k < dlog_std.size(); ++k) dlog_std[k] += other.dlog_std[k];
}

Ppo::Ppo(const PpoConfig& config, const EnvSpec& spec, uint64_t seed, ThreadPool& pool)
    : config_(Checked(config, spec)),
      D_(spec.obs_size),
      B_(static_cast<int>(config.batch)),
      limit_(spec.action_limit),
      torques_(config.discrete() ? TorqueLevels(limit_[0], config.levels) : std::vector<double>()),
      mirror_signs_(spec.mirror_signs),
      pool_(pool),
      shuffle_rng_(seed, "minibatches"),
      mirror_rng_(seed, "mirror"),
      actor_(config.Shape(D_),
             config.discrete() ? static_cast<int>(config.levels) : spec.action_size(),
             config.discrete() ? 0 : limit_.size(), B_),
      critic_(config.Shape(D_), 1, 0, B_),
      std_(config.discrete() ? 0 : limit_.size()),
      normalizer_(D_),
      rollout_(config.horizon, spec.num_envs, D_, spec.action_size()),
      order_(static_cast<size_t>(rollout_.size())),
      value_(order_.size()),
      next_value_(order_.size()),
      advantage_(order_.size()),
      target_(order_.size()),
      act_activations_(actor_.network.MakeActivations(spec.num_envs, false)),
      act_obs_(static_cast<size_t>(spec.num_envs * D_)),
      act_outputs_(static_cast<size_t>(spec.num_envs) * actor_.y.size() / config.batch),
      obs_(static_cast<size_t>(B_ * D_)),
      action_(static_cast<size_t>(B_) * limit_.size()),
      old_log_prob_(static_cast<size_t>(B_)),
      old_value_(old_log_prob_.size()),
      batch_advantage_(old_log_prob_.size()),
      batch_target_(old_log_prob_.size()),
      mirrored_(old_log_prob_.size()),
      sums_(static_cast<size_t>(slices())) {
  for (int block = 0; block < Blocks(spec.num_envs); ++block) {
    explore_rngs_.emplace_back(seed, "exploration", static_cast<uint64_t>(block));
  }
  std::iota(order_.begin(), order_.end(), 0);
  Rng init_rng(seed, "initial parameters");
  const auto weights = [](Learner& learner) {
    return std::span(learner.theta).first(learner.network.num_parameters());
  };
  InitializeOrthogonal(actor_.network, kOutputGain, init_rng, weights(actor_));
  InitializeOrthogonal(critic_.network, 1, init_rng, weights(critic_));
  std::fill(actor_.theta.end() - static_cast<ptrdiff_t>(std_.size()), actor_.theta.end(),
            static_cast<float>(std::log(config.initial_std)));
  SetStd();
}

std::span<const float> Ppo::log_std() const { return std::span(actor_.theta).last(std_.size()); }

void Ppo::SetStd() {
  for (float& x : std::span(actor_.theta).last(std_.size())) {
    x = std::clamp(x, static_cast<float>(kLogStdLow), static_cast<float>(kLogStdHigh));
  }
  for (size_t k = 0; k < std_.size(); ++k) std_[k] = std::exp(log_std()[k]);
}

double Ppo::scheduled_rate() const {
  const double progress =
      static_cast<double>(steps_) / static_cast<double>(config_.learning_rate_steps);
  return std::lerp(config_.learning_rate, config_.learning_rate_end, std::min(1.0, progress));
}

void Ppo::Act(Matrix<const float> obs, Matrix<double> action) {
  const int N = obs.rows();
  const Matrix<float> normal(act_obs_, N, D_);
  const Matrix<float> outputs(act_outputs_.data(), N, static_cast<int>(act_outputs_.size()) / N);
  std::ranges::copy(obs.values(), rollout_.obs().values().begin());
  pool_.ParallelFor(Blocks(N), [&](int block) {
    const RowRange rows{block * kActRows, std::min(kActRows, N - block * kActRows)};
    for (int i = rows.first; i < rows.first + rows.count; ++i) {
      normalizer_.Apply(obs.row(i), normal.row(i));
    }
    actor_.network.Forward({actor_.weights()}, normal, rows, act_activations_, outputs);
    Sample(rows, outputs, explore_rngs_[static_cast<size_t>(block)], action);
  });
}

void Ppo::Sample(RowRange rows, Matrix<const float> outputs, Rng& rng, Matrix<double> action) {
  const Matrix<float> stored = rollout_.action();
  const std::span<float> log_prob = rollout_.log_prob();
  std::vector<float> p(torques_.size());
  for (int i = rows.first; i < rows.first + rows.count; ++i) {
    const auto row = static_cast<size_t>(i);
    if (config_.discrete()) {
      const Categorical<float> policy(outputs.row(i), p);
      const size_t level = policy.Sample(rng);
      stored(i, 0) = static_cast<float>(level);
      log_prob[row] = policy.LogProb(level);
      action(i, 0) = torques_[level];
    } else {
      const DiagonalGaussian<float> policy{outputs.row(i), log_std(), std_};
      policy.Sample(rng, stored.row(i));
      log_prob[row] = policy.LogProb(stored.row(i));
      // The environment gets what is within the limit; π speaks of what was drawn.
      for (int k = 0; k < stored.cols(); ++k) {
        action(i, k) = limit_[static_cast<size_t>(k)] * std::clamp(stored(i, k), -1.0F, 1.0F);
      }
    }
  }
}

void Ppo::Observe(const StepResult& result) {
  rollout_.Add(result, config_.reward_scale);
  steps_ += rollout_.num_envs();
}

int Ppo::slices() const {
  const int rows = Slice(0).count;
  return (B_ + rows - 1) / rows;
}

RowRange Ppo::Slice(int slice) const {
  // Enough slices for some threads, enough rows for the kernels; from B alone, so that the number
  // of threads changes no bit.
  const int rows = std::min(B_, std::clamp(B_ / 8, 8, 64));
  return {slice * rows, std::min(rows, B_ - slice * rows)};
}

void Ppo::Values(Matrix<const float> obs, std::span<float> values) {
  for (int first = 0; first < obs.rows(); first += B_) {
    const int count = std::min(B_, obs.rows() - first);
    const Matrix<float> normal(obs_.data(), count, D_);
    const Matrix<float> y(values.data() + first, count, 1);
    const int rows = Slice(0).count;
    pool_.ParallelFor((count + rows - 1) / rows, [&](int slice) {
      const RowRange part{slice * rows, std::min(rows, count - slice * rows)};
      for (int i = part.first; i < part.first + part.count; ++i) {
        normalizer_.Apply(obs.row(first + i), normal.row(i));
      }
      critic_.network.Forward({critic_.weights()}, normal, part, critic_.activations, y);
    });
  }
}

void Ppo::Estimate() {
  const int T = static_cast<int>(config_.horizon), N = rollout_.num_envs();
  Values(rollout_.all_obs(), value_);

  // The successor's value is that of the next row, but where an episode or the rollout ends.
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
      next_value_[static_cast<size_t>(row)] = t < T - 1 ? value_[static_cast<size_t>(row + N)] : 0;
    }
  }
  std::vector<float> end_value(ends.size());
  Values({end_obs.data(), static_cast<int>(ends.size()), D_}, end_value);
  for (size_t i = 0; i < ends.size(); ++i) next_value_[static_cast<size_t>(ends[i])] = end_value[i];

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
  Estimate();
  double kl = 0;
  for (int64_t epoch = 0; epoch < config_.epochs; ++epoch) {
    // A whole epoch, shuffled (Fisher and Yates).
    for (size_t i = order_.size(); i > 1; --i) {
      std::swap(order_[i - 1], order_[shuffle_rng_.Below(i)]);
    }
    const double before = kl_sum_;
    for (size_t first = 0; first < order_.size(); first += static_cast<size_t>(B_)) {
      Update(std::span(order_).subspan(first, static_cast<size_t>(B_)));
    }
    kl = (kl_sum_ - before) * static_cast<double>(B_) / static_cast<double>(order_.size());
  }
  AdaptRate(kl);
  // From the next rollout on: this one's probabilities, old and new, were of the same statistics.
  if (config_.normalize) normalizer_.Add(rollout_.all_obs());
  rollout_.Clear();
}

void Ppo::AdaptRate(double kl) {
  if (config_.kl_target == 0) return;
  if (kl > 2 * config_.kl_target) rate_factor_ /= kRateStep;
  if (kl < config_.kl_target / 2) rate_factor_ *= kRateStep;
  rate_factor_ = std::clamp(rate_factor_, kRateFactor.lowest, kRateFactor.highest);
}

void Ppo::Update(std::span<const int64_t> rows) {
  for (size_t i = 0; i < rows.size(); ++i) {
    batch_advantage_[i] = advantage_[static_cast<size_t>(rows[i])];
  }
  Standardize(batch_advantage_);
  if (config_.mirror) {
    for (uint8_t& mirrored : mirrored_) mirrored = mirror_rng_.Next() >> 63;
  }

  // Threads share the weights (to copy them into the layouts that the products read), then slices
  // of the batch, then the weights again.
  const int actor_tasks = actor_.network.num_tasks();
  const int tasks = actor_tasks + critic_.network.num_tasks();
  pool_.ParallelFor(tasks, [&](int task) {
    Learner& learner = task < actor_tasks ? actor_ : critic_;
    learner.network.Prepare(task < actor_tasks ? task : task - actor_tasks, learner.weights(),
                            learner.prepared);
  });
  pool_.ParallelFor(slices(), [&](int slice) {
    Sums& sums = sums_[static_cast<size_t>(slice)];
    sums = {.dlog_std = std::vector<float>(std_.size())};
    Gather(rows, Slice(slice));
    BackwardActor(Slice(slice), sums);
    BackwardCritic(Slice(slice), sums);
  });
  const Matrix<const float> s(obs_.data(), B_, D_);
  pool_.ParallelFor(tasks, [&](int task) {
    Learner& learner = task < actor_tasks ? actor_ : critic_;
    const int part = task < actor_tasks ? task : task - actor_tasks;
    learner.squares[static_cast<size_t>(part)] =
        learner.network.BackwardWeights(part, s, learner.activations, learner.gradient);
  });
  Sums sums{.dlog_std = std::vector<float>(std_.size())};
  for (const Sums& part : sums_) sums.Add(part);
  CountUpdate(sums);

  double squares = 0;  // of the gradient with respect to ln σ
  for (const float g : sums.dlog_std) squares += double{g} * g;
  std::ranges::copy(sums.dlog_std, actor_.gradient.end() - static_cast<ptrdiff_t>(std_.size()));
  norm_sum_ += Step(actor_, learning_rate(), squares);
  Step(critic_, scheduled_rate(), 0);
  SetStd();
  ++updates_;
  ++report_updates_;
}

double Ppo::Step(Learner& learner, double learning_rate, double squares) {
  const double norm =
      std::sqrt(std::accumulate(learner.squares.begin(), learner.squares.end(), squares));
  learner.adam.Step({learning_rate, norm, config_.max_gradient_norm, 0}, learner.gradient,
                    learner.theta, {}, pool_);
  return norm;
}

void Ppo::Gather(std::span<const int64_t> from, RowRange rows) {
  const Matrix<float> s(obs_.data(), B_, D_);
  const Matrix<float> a(action_.data(), B_, static_cast<int>(limit_.size()));
  const auto last_level = static_cast<float>(config_.levels - 1);
  std::vector<float> raw(static_cast<size_t>(D_));
  for (int i = rows.first; i < rows.first + rows.count; ++i) {
    const auto row = static_cast<size_t>(i);
    const auto source = static_cast<int>(from[row]);
    const auto place = static_cast<size_t>(from[row]);
    const bool mirror = mirrored_[row] != 0;
    std::ranges::copy(rollout_.all_obs().row(source), raw.begin());
    std::ranges::copy(rollout_.all_actions().row(source), a.row(i).begin());
    if (mirror) {
      // The mirrored step was drawn as often as the step itself: it has the same π_old.
      for (size_t k = 0; k < raw.size(); ++k) raw[k] *= mirror_signs_[k];
      for (float& x : a.row(i)) x = config_.discrete() ? last_level - x : -x;
    }
    normalizer_.Apply(raw, s.row(i));
    old_log_prob_[row] = rollout_.log_probs().data()[place];
    old_value_[row] = value_[place];
    batch_target_[row] = target_[place];
  }
}

void Ppo::BackwardActor(RowRange rows, Sums& sums) {
  const Matrix<const float> s(obs_.data(), B_, D_);
  const Matrix<const float> a(action_.data(), B_, static_cast<int>(limit_.size()));
  const int outputs = static_cast<int>(actor_.y.size()) / B_;
  const Matrix<float> y(actor_.y.data(), B_, outputs), dy(actor_.dy.data(), B_, outputs);
  const Network<float>::Weights weights{actor_.weights(), &actor_.prepared};
  actor_.network.Forward(weights, s, rows, actor_.activations, y);

  // L = mean of -min(r A, clip(r) A) - c H
  const auto B = static_cast<float>(B_);
  const auto clip = static_cast<float>(config_.clip);
  const float dentropy = -static_cast<float>(config_.entropy_bonus) / B;
  std::vector<float> p(torques_.size());
  for (int i = rows.first; i < rows.first + rows.count; ++i) {
    const auto row = static_cast<size_t>(i);
    const auto backward = [&](float log_prob, float entropy, const auto& gradient) {
      const float log_ratio = log_prob - old_log_prob_[row];
      const float ratio = std::exp(log_ratio);
      const LossTerm<float> term = ClippedLoss(ratio, batch_advantage_[row], clip);
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
      const DiagonalGaussian<float> policy{y.row(i), log_std(), std_};
      backward(policy.LogProb(a.row(i)), policy.Entropy(), [&](float dlog_prob) {
        policy.Backward(a.row(i), dlog_prob, dentropy, dy.row(i), sums.dlog_std);
      });
    }
  }
  actor_.network.BackwardInputs(weights, dy, rows, actor_.activations);
}

void Ppo::BackwardCritic(RowRange rows, Sums& sums) {
  const Matrix<const float> s(obs_.data(), B_, D_);
  const Matrix<float> V(critic_.y.data(), B_, 1), dV(critic_.dy.data(), B_, 1);
  const Network<float>::Weights weights{critic_.weights(), &critic_.prepared};
  critic_.network.Forward(weights, s, rows, critic_.activations, V);
  const auto clip = static_cast<float>(config_.value_clip);
  for (int i = rows.first; i < rows.first + rows.count; ++i) {
    const auto row = static_cast<size_t>(i);
    const LossTerm<float> term = ValueLoss(V(i, 0), old_value_[row], batch_target_[row], clip);
    dV(i, 0) = term.gradient / static_cast<float>(B_);
    sums.value_loss += term.loss;
  }
  critic_.network.BackwardInputs(weights, dV, rows, critic_.activations);
}

void Ppo::CountUpdate(const Sums& sums) {
  const double B = B_;
  if (!std::isfinite(sums.policy_loss + sums.value_loss + sums.kl)) {
    throw Failure(Concat("the losses are ", sums.policy_loss / B, " and ", sums.value_loss / B,
                         ", the KL divergence ", sums.kl / B, " in update ", updates_ + 1,
                         ", expected finite numbers"));
  }
  policy_loss_sum_ += sums.policy_loss / B;
  value_loss_sum_ += sums.value_loss / B;
  entropy_sum_ += sums.entropy / B;
  kl_sum_ += sums.kl / B;
  clipped_sum_ += sums.clipped / B;
}

Metrics Ppo::TakeMetrics() {
  const double n = static_cast<double>(std::max<int64_t>(1, report_updates_));
  Metrics metrics{{"updates", static_cast<double>(updates_)},
                  {"learning_rate", learning_rate()},
                  {"policy_loss", policy_loss_sum_ / n},
                  {"value_loss", value_loss_sum_ / n},
                  {"entropy", entropy_sum_ / n},
                  {"kl", kl_sum_ / n},
                  {"clip_share", clipped_sum_ / n},
                  {"explained_variance", explained_variance_},
                  {"gradient_norm", norm_sum_ / n}};
  if (!std_.empty()) {
    const double sum = std::accumulate(std_.begin(), std_.end(), 0.0);
    metrics.emplace_back("std", sum / static_cast<double>(std_.size()));
  }
  policy_loss_sum_ = value_loss_sum_ = entropy_sum_ = kl_sum_ = clipped_sum_ = norm_sum_ = 0;
  report_updates_ = 0;
  return metrics;
}

}  // namespace upswing
