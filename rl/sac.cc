// Soft Actor-Critic (Haarnoja et al., 2018). Symbols: see rl/sac.h.
#include "rl/sac.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "core/error.h"
#include "core/text.h"
#include "nn/actor_policy.h"
#include "rl/representation.h"

namespace upswing {
namespace {

size_t Size(int rows, int cols) { return static_cast<size_t>(rows) * static_cast<size_t>(cols); }

/// The part of some numbers (B) that belongs to these rows.
template <typename Values>
auto Part(Values& values, RowRange rows) {
  return std::span(values).subspan(static_cast<size_t>(rows.first),
                                   static_cast<size_t>(rows.count));
}

/// Writes the observations (B × D) of some rows and, behind each, A numbers.
void JoinRows(Matrix<const float> obs, Matrix<const float> action, RowRange rows,
              Matrix<float> joined) {
  for (int i = rows.first; i < rows.first + rows.count; ++i) {
    float* row = std::ranges::copy(obs.row(i), joined.row(i).data()).out;
    std::ranges::copy(action.row(i), row);
  }
}

}  // namespace

void SoftTargets(std::span<const float> q1, std::span<const float> q2,
                 std::span<const float> log_prob, double alpha, std::span<const float> reward,
                 std::span<const float> discount, std::span<float> y) {
  for (size_t i = 0; i < y.size(); ++i) {
    const float value = std::min(q1[i], q2[i]) - static_cast<float>(alpha) * log_prob[i];
    y[i] = reward[i] + discount[i] * value;
  }
}

Sac::Sac(const SacConfig& config, const EnvSpec& spec, uint64_t seed, ThreadPool& pool)
    : OffPolicyAgent(config, spec, ActionSpace{spec.action_size()}, seed),
      config_(config),
      D_(spec.obs_size),
      A_(spec.action_size()),
      B_(static_cast<int>(config.batch)),
      action_limit_(spec.action_limit),
      bins_(static_cast<int>(config.bins), config.value_low, config.value_high),
      pool_(pool),
      noise_rng_(seed, "policy noise"),
      actor_([&] {
        Rng rng(seed, "initial actor");
        return TrainedNetwork(config.Trunk(D_), {2 * A_}, B_, rng);
      }()),
      theta_policy_(actor_.theta().begin(), actor_.theta().end()),
      log_alpha_(1, static_cast<float>(std::log(std::max(1e-30, config.alpha)))),
      alpha_adam_(1),
      actor_outputs_(Size(B_, 2 * A_)),
      actor_dy_(actor_outputs_.size()),
      gaussians_(Size(B_, A_)),
      samples_(gaussians_.size()),
      log_prob_(static_cast<size_t>(B_)),
      inputs_(Size(B_, D_ + A_)),
      policy_inputs_(inputs_.size()),
      y_(log_prob_.size()),
      act_activations_(actor_.network().MakeActivations(spec.num_envs, false)),
      act_outputs_(Size(spec.num_envs, 2 * A_)),
      mean_(act_action_.size()),
      last_mean_(act_action_.size()),
      begins_(static_cast<size_t>(spec.num_envs), 1) {
  for (size_t i = 0; i < num_critics(); ++i) {
    Rng rng(seed, "initial critic", i);
    TrainedNetwork network(config.Trunk(D_ + A_), {bins_.outputs()}, B_, rng);
    AlignedVector<float> target(network.theta().begin(), network.theta().end());
    const AlignedVector<float> outputs(Size(B_, bins_.outputs())), value(y_.size());
    critics_.push_back({std::move(network), std::move(target), outputs, outputs, value, inputs_});
  }
}

double Sac::alpha() const { return std::exp(double{log_alpha_[0]}); }

void Sac::Act(Matrix<const float> obs, Matrix<double> action) {
  const Matrix<float> outputs(act_outputs_, obs.rows(), 2 * A_);
  ForSlices(pool_, obs.rows(), [&](RowRange rows) {
    actor_.network().Forward({actor_.theta()}, obs, rows, act_activations_, outputs);
  });
  Remember(obs);
  const bool random = steps_ < config_.learning_starts;
  for (int env = 0; env < obs.rows(); ++env) {
    for (int k = 0; k < A_; ++k) {
      const auto i = Size(env, A_) + static_cast<size_t>(k);
      const auto policy = Gaussian<float>::From(outputs(env, k), outputs(env, A_ + k));
      const double u = policy.mean + policy.std * explore_rng_.Normal();
      const double chosen = random ? explore_rng_.Uniform(-1, 1) : std::tanh(u);
      act_action_[i] = static_cast<float>(chosen);
      action(env, k) = action_limit_[static_cast<size_t>(k)] * act_action_[i];
      if (config_.smoothness > 0) mean_[i] = std::tanh(policy.mean);
    }
  }
}

double Sac::RewardOf(const StepResult& result, size_t env) {
  double reward = OffPolicyAgent::RewardOf(result, env);
  if (config_.smoothness == 0) return reward;
  const auto A = static_cast<size_t>(A_);
  for (size_t i = env * A; i < (env + 1) * A; ++i) {
    const double change = double{mean_[i]} - last_mean_[i];
    if (begins_[env] == 0) reward -= config_.smoothness * change * change;
    last_mean_[i] = mean_[i];
  }
  begins_[env] = result.done(env) ? 1 : 0;
  return reward;
}

void Sac::Update(const Minibatch& batch) {
  UpdateCritics(batch);
  ++updates_;
  ++report_updates_;
  if (updates_ % config_.actor_period == 0) UpdateActor(batch);
}

void Sac::DrawNoise() {
  // Both numbers of Box and Muller (1958) for two samples.
  for (size_t i = 0; i < samples_.size(); i += 2) {
    const std::array<double, 2> pair = noise_rng_.NormalPair();
    samples_[i].epsilon = static_cast<float>(pair[0]);
    if (i + 1 < samples_.size()) samples_[i + 1].epsilon = static_cast<float>(pair[1]);
  }
}

void Sac::SampleRows(Matrix<const float> obs, RowRange rows, Matrix<float> inputs) {
  const Matrix<float> outputs(actor_outputs_, B_, 2 * A_);
  actor_.Forward(obs, rows, outputs);
  for (int i = rows.first; i < rows.first + rows.count; ++i) {
    float log_prob = 0;
    float* action = std::ranges::copy(obs.row(i), inputs.row(i).data()).out;
    for (int k = 0; k < A_; ++k) {
      const size_t at = Size(i, A_) + static_cast<size_t>(k);
      gaussians_[at] = Gaussian<float>::From(outputs(i, k), outputs(i, A_ + k));
      samples_[at] = Squash(gaussians_[at], samples_[at].epsilon);
      action[k] = samples_[at].action;
      log_prob += samples_[at].log_prob;
    }
    log_prob_[static_cast<size_t>(i)] = log_prob;
  }
}

void Sac::ValueRows(Critic& critic, RowRange rows) const {
  const Matrix<const float> outputs(critic.outputs.data(), B_, bins_.outputs());
  for (int i = rows.first; i < rows.first + rows.count; ++i) {
    critic.value[static_cast<size_t>(i)] = bins_.Value(outputs.row(i));
  }
}

void Sac::CriticRows(const Minibatch& batch, RowRange rows) {
  const Matrix<const float> s(batch.obs.data(), B_, D_), s_next(batch.next_obs.data(), B_, D_);
  const Matrix<float> sa(inputs_, B_, D_ + A_), next_sa(policy_inputs_, B_, D_ + A_);
  // y = r + γⁿ (min Q'(s', a') - α ln π(a'|s')), a' ~ π(s')
  SampleRows(s_next, rows, next_sa);
  for (Critic& critic : critics_) {
    critic.network.Forward(critic.target, next_sa, rows, {critic.outputs, B_, bins_.outputs()});
    ValueRows(critic, rows);
  }
  SoftTargets(Part(critics_.front().value, rows), Part(critics_.back().value, rows),
              Part(log_prob_, rows), alpha(), Part(batch.reward, rows), Part(batch.discount, rows),
              Part(y_, rows));

  // The gradient of the mean loss between Q(s, a) and y.
  JoinRows(s, {batch.action.data(), B_, A_}, rows, sa);
  for (Critic& critic : critics_) {
    const Matrix<float> outputs(critic.outputs, B_, bins_.outputs());
    const Matrix<float> dy(critic.dy, B_, bins_.outputs());
    critic.network.Forward(sa, rows, outputs);
    ValueRows(critic, rows);
    for (int i = rows.first; i < rows.first + rows.count; ++i) {
      const auto row = static_cast<size_t>(i);
      bins_.Loss(outputs.row(i), y_[row], dy.row(i));
      const float weight = batch.weight[row] / static_cast<float>(B_);
      for (float& gradient : dy.row(i)) gradient *= weight;
    }
    critic.network.Backward(dy, rows);
  }
}

void Sac::UpdateCritics(const Minibatch& batch) {
  DrawNoise();
  for (Critic& critic : critics_) critic.network.Prepare(pool_);
  ForSlices(pool_, B_, [&](RowRange rows) { CriticRows(batch, rows); });
  CountErrors();
  for (Critic& critic : critics_) {
    norm_sum_ += critic.network.Step({inputs_.data(), B_, D_ + A_}, learning_rate(),
                                     config_.max_gradient_norm, critic.target, config_.tau, pool_) /
                 static_cast<double>(critics_.size());
  }
}

void Sac::ActorRows(const Minibatch& batch, RowRange rows) {
  const Matrix<const float> s(batch.obs.data(), B_, D_);
  const Matrix<float> sa(policy_inputs_, B_, D_ + A_);
  SampleRows(s, rows, sa);
  for (Critic& critic : critics_) {
    critic.network.Forward(sa, rows, {critic.outputs, B_, bins_.outputs()});
    ValueRows(critic, rows);
  }
  // dQ/da of the critic whose value is smaller; nothing of the other one.
  for (Critic& critic : critics_) {
    const Critic& other = &critic == &critics_.front() ? critics_.back() : critics_.front();
    const Matrix<float> outputs(critic.outputs, B_, bins_.outputs());
    const Matrix<float> dy(critic.dy, B_, bins_.outputs());
    for (int i = rows.first; i < rows.first + rows.count; ++i) {
      const auto row = static_cast<size_t>(i);
      const bool counts = critic.value[row] < other.value[row] ||
                          (critic.value[row] == other.value[row] && &critic == &critics_.front());
      bins_.ValueGradient(outputs.row(i), counts ? 1.0F : 0.0F, dy.row(i));
    }
    critic.network.Backward(dy, rows, {critic.dinputs, B_, D_ + A_});
  }
  // The gradient of the mean of α ln π(a|s) - min Q(s, a).
  const auto temperature = static_cast<float>(alpha());
  const Matrix<float> dy(actor_dy_, B_, 2 * A_);
  for (int i = rows.first; i < rows.first + rows.count; ++i) {
    for (int k = 0; k < A_; ++k) {
      const size_t at = Size(i, A_) + static_cast<size_t>(k);
      float dq_da = 0;
      for (Critic& critic : critics_) {
        dq_da += Matrix<float>(critic.dinputs, B_, D_ + A_)(i, D_ + k);
      }
      const GaussianGradient<float> g =
          SquashedGradient(gaussians_[at], samples_[at], temperature, dq_da);
      dy(i, k) = g.mean / static_cast<float>(B_);
      dy(i, A_ + k) = g.log_std / static_cast<float>(B_);
    }
  }
  actor_.Backward(dy, rows);
}

void Sac::UpdateActor(const Minibatch& batch) {
  DrawNoise();
  for (Critic& critic : critics_) critic.network.Prepare(pool_);
  actor_.Prepare(pool_);
  ForSlices(pool_, B_, [&](RowRange rows) { ActorRows(batch, rows); });
  actor_.Step({batch.obs.data(), B_, D_}, config_.actor_rate * learning_rate(),
              config_.max_gradient_norm, theta_policy_, AveragingTau(config_.policy_tau), pool_);
  UpdateTemperature();
}

void Sac::UpdateTemperature() {
  double mean_log_prob = 0;
  for (const float log_prob : log_prob_) mean_log_prob += log_prob / static_cast<double>(B_);
  entropy_sum_ -= mean_log_prob;
  ++report_actor_updates_;
  if (!config_.tune_alpha) return;
  const AlignedVector<float> gradient(
      1, static_cast<float>(TemperatureGradient(mean_log_prob, A_ * config_.target_entropy)));
  AlignedVector<float> unused(1);
  alpha_adam_.Step({config_.alpha_rate, std::abs(gradient[0]), 1e9, 0}, gradient, log_alpha_,
                   unused, pool_);
}

void Sac::CountErrors() {
  double loss = 0, q = 0, td = 0;
  std::ranges::fill(td_error_, 0.0F);
  for (const Critic& critic : critics_) {
    for (size_t i = 0; i < y_.size(); ++i) {
      const double error = double{critic.value[i]} - y_[i];
      loss += error * error / 2;
      td += std::abs(error);
      q += critic.value[i];
      // A transition's priority is the mean of both.
      td_error_[i] += static_cast<float>(std::abs(error) / static_cast<double>(critics_.size()));
    }
  }
  const double n = static_cast<double>(critics_.size() * y_.size());
  if (!std::isfinite(loss)) {
    throw Failure(
        Concat("the loss is ", loss, " in update ", updates_ + 1, ", expected a finite number"));
  }
  loss_sum_ += loss / n;
  q_sum_ += q / n;
  td_sum_ += td / n;
}

Metrics Sac::TakeMetrics() {
  const double n = static_cast<double>(std::max<int64_t>(1, report_updates_));
  const double actor_n = static_cast<double>(std::max<int64_t>(1, report_actor_updates_));
  constexpr int kMostRows = 256;  // enough of a large minibatch
  const Matrix<const float> features(
      critics_.front().network.activations().trunk.back().output.data(), std::min(B_, kMostRows),
      static_cast<int>(config_.hidden.back()));
  Metrics metrics{{"updates", static_cast<double>(updates_)},
                  {"alpha", alpha()},
                  {"entropy", entropy_sum_ / actor_n},
                  {"learning_rate", learning_rate()},
                  {"loss", loss_sum_ / n},
                  {"q", q_sum_ / n},
                  {"td_error", td_sum_ / n},
                  {"gradient_norm", norm_sum_ / n},
                  {"feature_rank", FeatureRank(features)},
                  {"dormant_share", DormantShare(features)}};
  loss_sum_ = q_sum_ = td_sum_ = norm_sum_ = entropy_sum_ = 0;
  report_updates_ = report_actor_updates_ = 0;
  return metrics;
}

std::unique_ptr<Policy> Sac::ExportPolicy(PolicyInfo info) const {
  info.gamma = config_.gamma;
  info.reward_scale = config_.reward_scale;
  ActorParts parts;
  parts.actor = config_.Trunk(D_);
  parts.parameters.assign(theta_policy_.begin(), theta_policy_.end());
  parts.action_limit = action_limit_;
  if (config_.bins == 0) {
    parts.critic = config_.Trunk(D_ + A_);
    const std::span<const float> theta = critics_.front().network.theta();
    parts.critic_parameters.assign(theta.begin(), theta.end());
  }
  return std::make_unique<ActorPolicy>(std::move(parts), std::move(info));
}

void Sac::State(const Archive& archive) {
  constexpr Bounds<double> kSum{0, std::numeric_limits<double>::max()};
  constexpr Bounds<float> kUnitRange{-1, 1};
  actor_.State(archive.In("actor"));
  archive.Array("theta_policy", std::span(theta_policy_));
  for (size_t i = 0; i < critics_.size(); ++i) {
    const Archive in = archive.In(Concat("critic", i + 1));
    critics_[i].network.State(in);
    in.Array("theta_target", std::span(critics_[i].target));
  }
  archive.Array("log_alpha", std::span(log_alpha_), {-100, 100});
  alpha_adam_.State(archive.In("alpha_adam"));
  noise_rng_.State(archive.In("noise_rng"));
  archive.Array("last_mean", std::span(last_mean_), kUnitRange);
  archive.Array("begins", std::span(begins_), {0, 1});
  SharedState(archive);
  const int64_t of_actor = updates_ / config_.actor_period;
  archive.Check(critics_.front().network.steps() == updates_ &&
                    critics_.back().network.steps() == updates_ && actor_.steps() == of_actor &&
                    alpha_adam_.steps() == (config_.tune_alpha ? of_actor : 0),
                "updates", "as many steps of Adam");
  archive.Scalar("report_updates", report_updates_, {0, updates_});
  archive.Scalar("report_actor_updates", report_actor_updates_, {0, of_actor});
  archive.Scalar("loss_sum", loss_sum_, kSum);
  archive.Scalar("q_sum", q_sum_, kAnyNumber<double>);
  archive.Scalar("td_sum", td_sum_, kSum);
  archive.Scalar("norm_sum", norm_sum_, kSum);
  archive.Scalar("entropy_sum", entropy_sum_, kAnyNumber<double>);
}

}  // namespace upswing
