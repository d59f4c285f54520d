// The gradient steps of Soft Actor-Critic. Symbols: see rl/sac/sac.h.
#include <algorithm>
#include <array>
#include <cmath>
#include <numeric>

#include "nn/linear.h"
#include "rl/sac/sac.h"

namespace upswing {
namespace {

/// Copies some rows of x into the columns of y from `column` on.
void CopyRows(Matrix<const float> x, RowRange rows, int column, Matrix<float> y) {
  for (int i = rows.first; i < rows.first + rows.count; ++i) {
    // Too few numbers for a call to copy.
    for (int k = 0; k < x.cols(); ++k) y(i, column + k) = x(i, k);
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

void Sac::Update(const Minibatch& batch) {
  UpdateCritics(batch);
  ++updates_;
  if (updates_ % config_.actor_period == 0) UpdateActor(batch);
}

void Sac::DrawNoise() {
  // Use both numbers of Box and Muller (1958), for two samples.
  AlignedVector<float>& epsilon = samples_.epsilon;
  for (size_t i = 0; i < epsilon.size(); i += 2) {
    const std::array<double, 2> pair = noise_rng_.NormalPair();
    epsilon[i] = static_cast<float>(pair[0]);
    if (i + 1 < epsilon.size()) epsilon[i + 1] = static_cast<float>(pair[1]);
  }
}

void Sac::SampleRows(Matrix<const float> obs, RowRange rows, Matrix<float> inputs) {
  constexpr float kLow = kLogStdLow, kHigh = kLogStdHigh;
  const Matrix<float> outputs(actor_outputs_, B_, 2 * A_);
  actor_.Forward(obs, rows, outputs);
  Samples& x = samples_;
  for (int i = rows.first; i < rows.first + rows.count; ++i) {
    for (int k = 0; k < A_; ++k) {
      const size_t at = Size(i, A_) + k;
      x.mean[at] = outputs(i, k);
      x.log_std[at] = std::clamp(outputs(i, A_ + k), kLow, kHigh);
    }
  }
  const RowRange parts{rows.first * A_, rows.count * A_};
  SquashSamples(Part(x.mean, parts), Part(x.log_std, parts), Part(x.epsilon, parts),
                Part(x.deviation, parts), Part(x.action, parts), Part(x.log_prob, parts));
  CopyRows(obs, rows, 0, inputs);
  CopyRows({x.action.data(), B_, A_}, rows, D_, inputs);
  for (int i = rows.first; i < rows.first + rows.count; ++i) {
    const std::span<const float> each = Matrix<const float>(x.log_prob.data(), B_, A_).row(i);
    log_prob_[i] = std::accumulate(each.begin(), each.end(), 0.0F);
  }
}

void Sac::CriticRows(const Minibatch& batch, RowRange rows) {
  const Matrix<const float> s(batch.obs.data(), B_, D_), s_next(batch.next_obs.data(), B_, D_);
  const Matrix<float> sa(inputs_, B_, D_ + A_), next_sa(policy_inputs_, B_, D_ + A_);
  // y = r + γⁿ (min Q'(s', a') - α ln π(a'|s')), a' ~ π(s'); α = 0 without entropy_reward
  SampleRows(s_next, rows, next_sa);
  for (Critic& critic : critics_) {
    critic.network.Forward(critic.target, next_sa, rows, {critic.value, B_, 1});
  }
  SoftTargets(Part(critics_.front().value, rows), Part(critics_.back().value, rows),
              Part(log_prob_, rows), config_.entropy_reward ? alpha() : 0.0,
              Part(batch.reward, rows), Part(batch.discount, rows), Part(y_, rows));

  // Compute the gradient of the mean loss between Q(s, a) and y.
  CopyRows(s, rows, 0, sa);
  CopyRows({batch.action.data(), B_, A_}, rows, D_, sa);
  for (Critic& critic : critics_) {
    critic.network.Forward(sa, rows, {critic.value, B_, 1});
    for (int i = rows.first; i < rows.first + rows.count; ++i) {
      const float error = critic.value[i] - y_[i];
      critic.loss[i] = batch.weight[i] * (error * error / 2);
      critic.dy[i] = error * (batch.weight[i] / static_cast<float>(B_));
    }
    critic.network.Backward({critic.dy, B_, 1}, rows);
  }
}

void Sac::UpdateCritics(const Minibatch& batch) {
  DrawNoise();
  for (Critic& critic : critics_) critic.network.Prepare(pool_);
  ForSlices(pool_, B_, [&](RowRange rows) { CriticRows(batch, rows); });
  CountMinibatch();
  if (config_.off_policy.reward_centering > 0) CenterCritics(batch);
  for (Critic& critic : critics_) {
    norm_sum_ += critic.network.Step({inputs_.data(), B_, D_ + A_}, learning_rate(),
                                     config_.off_policy.max_gradient_norm, critic.target,
                                     config_.tau, pool_) /
                 static_cast<double>(critics_.size());
  }
}

void Sac::CenterCritics(const Minibatch& batch) {
  for (Critic& critic : critics_) {
    double errors = 0;
    for (size_t i = 0; i < y_.size(); ++i) {
      errors += double{batch.weight[i]} * (critic.value[i] - y_[i]);
    }
    const float shift = CenteringShift(batch, errors);
    critic.network.network().ShiftOutputs(shift, critic.network.mutable_theta());
    critic.network.network().ShiftOutputs(shift, critic.target);
  }
}

void Sac::ActorRows(const Minibatch& batch, RowRange rows) {
  const Matrix<const float> s(batch.obs.data(), B_, D_);
  const Matrix<float> sa(policy_inputs_, B_, D_ + A_);
  SampleRows(s, rows, sa);
  for (Critic& critic : critics_) critic.network.Forward(sa, rows, {critic.value, B_, 1});
  // Compute dQ/da of the critic with the smaller value. The other critic contributes nothing.
  for (Critic& critic : critics_) {
    const Critic& other = &critic == &critics_.front() ? critics_.back() : critics_.front();
    for (int i = rows.first; i < rows.first + rows.count; ++i) {
      const bool counts = critic.value[i] < other.value[i] ||
                          (critic.value[i] == other.value[i] && &critic == &critics_.front());
      critic.dy[i] = counts ? 1.0F : 0.0F;
    }
    critic.network.Backward({critic.dy, B_, 1}, rows, {critic.dinputs, B_, D_ + A_});
  }
  // Compute the gradient of the mean of α ln π(a|s) - min Q(s, a).
  const auto temperature = static_cast<float>(alpha());
  const Matrix<float> dy(actor_dy_, B_, 2 * A_);
  for (int i = rows.first; i < rows.first + rows.count; ++i) {
    for (int k = 0; k < A_; ++k) {
      const size_t at = Size(i, A_) + k;
      float dq_da = 0;
      for (Critic& critic : critics_) {
        dq_da += Matrix<float>(critic.dinputs, B_, D_ + A_)(i, D_ + k);
      }
      const float log_std = samples_.log_std[at];
      const bool clamped = actor_outputs_[Size(i, 2 * A_) + static_cast<size_t>(A_ + k)] != log_std;
      const GaussianGradient<float> g = SquashedGradient<float>(
          {samples_.mean[at], log_std, samples_.deviation[at], clamped},
          {samples_.epsilon[at], samples_.action[at], samples_.log_prob[at]}, temperature, dq_da);
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
              config_.off_policy.max_gradient_norm, theta_policy_, AveragingTau(config_.policy_tau),
              pool_);
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
  const double norm = std::abs(gradient[0]);
  alpha_adam_.Step({config_.alpha_rate, norm, norm, 0}, gradient, log_alpha_, unused, pool_);
  log_alpha_[0] = std::clamp(log_alpha_[0], -kMostLogAlpha, kMostLogAlpha);
}

void Sac::CountMinibatch() {
  double loss = 0, q = 0, td = 0;
  std::ranges::fill(td_error_, 0.0F);
  for (const Critic& critic : critics_) {
    for (size_t i = 0; i < y_.size(); ++i) {
      const double error = double{critic.value[i]} - y_[i];
      loss += critic.loss[i];
      td += std::abs(error);
      q += critic.value[i];
      // The priority uses the mean |TD error| of the critics.
      td_error_[i] += static_cast<float>(std::abs(error) / static_cast<double>(critics_.size()));
    }
  }
  const double n = static_cast<double>(critics_.size() * y_.size());
  CountErrors(loss / n, q / n, td / n);
}

}  // namespace upswing
