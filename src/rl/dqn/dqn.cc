// Deep Q-Network (Mnih et al., 2015). Symbols: see rl/dqn/dqn.h.
#include "rl/dqn/dqn.h"

#include <algorithm>
#include <cmath>

#include "base/argmax.h"

namespace upswing {

void TdTargets(Matrix<const float> select, Matrix<const float> evaluate,
               std::span<const float> reward, std::span<const float> discount, std::span<float> y) {
  for (int i = 0; i < select.rows(); ++i) {
    y[i] = reward[i] + discount[i] * evaluate(i, ArgMax(select.row(i)));
  }
}

float HuberLoss(float delta) {
  const float size = std::abs(delta);
  return size <= 1 ? 0.5F * delta * delta : size - 0.5F;
}

float HuberGradient(float delta) { return std::clamp(delta, -1.0F, 1.0F); }

double Dqn::epsilon() const {
  const double decayed =
      config_.epsilon_start * std::pow(config_.epsilon_decay, static_cast<double>(episodes_));
  return std::max(decayed, config_.epsilon_end);
}

void Dqn::Act(Matrix<const float> obs, Matrix<double> action) {
  const Matrix<float> q(act_q_, obs.rows(), static_cast<int>(torques_.size()));
  online_.network().ForwardPreferences(online_.theta(), obs, {0, obs.rows()}, act_activations_, q);
  std::ranges::copy(obs.values(), act_obs_.begin());

  // Act ε-greedily: a random action with probability ε, else argmax_a Q(s, a; θ).
  for (int env = 0; env < obs.rows(); ++env) {
    const bool random = explore_rng_.Uniform() < epsilon();
    const int a =
        random ? static_cast<int>(explore_rng_.Below(torques_.size())) : ArgMax(q.row(env));
    act_action_[env] = static_cast<float>(a);
    action(env, 0) = torques_[a];
  }
}

void Dqn::Observe(const StepResult& result) {
  const int N = static_cast<int>(act_action_.size());
  const Matrix<const float> s(act_obs_.data(), N, D_), s_next(result.next_obs.data(), N, D_);
  for (int env = 0; env < N; ++env) {
    ExpectFinite(result, env);
    const double r = config_.off_policy.reward_scale * result.reward[env];
    // Only a terminal s' has no value. An episode that runs out of time bootstraps from s'.
    const double discount = result.terminated[env] != 0 ? 0 : config_.off_policy.gamma;
    Store(env, {s.row(env), s_next.row(env), {&act_action_[env], 1}, r, discount},
          result.done(env));
  }
}

void Dqn::Learn() {
  while (UpdateIsDue()) {  // updates_per_step for each step after learning_starts
    update_threads_.Run([&] { Update(Sample()); });
    UpdatePriorities();
  }
}

void Dqn::Update(const Minibatch& batch) {
  // Compute the gradient of L = mean w Huber(Q(s, a; θ) - y); w = 1 without priorities.
  online_.Prepare(pool_);
  ForSlices(pool_, B_, [&](RowRange rows) { BackwardRows(batch, rows); });
  CountMinibatch(batch);

  // Move θ with Adam, then θ⁻: θ⁻ ← θ⁻ + τ (θ - θ⁻), or θ⁻ ← θ every target_period updates.
  const bool polyak = config_.target_period == 0;
  norm_sum_ += online_.Step({batch.obs.data(), B_, D_}, learning_rate(),
                            config_.off_policy.max_gradient_norm, theta_target_,
                            polyak ? config_.tau : 0.0, pool_);
  ++updates_;
  if (!polyak && updates_ % config_.target_period == 0) {
    std::ranges::copy(online_.theta(), theta_target_.begin());
  }

  if (config_.policy_tau < 1) AveragePolicy();
  if (config_.off_policy.reward_centering > 0) CenterValues(batch);
}

void Dqn::BackwardRows(const Minibatch& batch, RowRange rows) {
  const int A = static_cast<int>(torques_.size());
  const Matrix<const float> s(batch.obs.data(), B_, D_), s_next(batch.next_obs.data(), B_, D_);
  const Matrix<float> q(q_, B_, A), q_target(q_target_, B_, A), dq(dq_, B_, A);
  const Matrix<float> q_select(
      config_.double_q || config_.off_policy.mirror ? q_select_ : q_target_, B_, A);

  // y = r + γⁿ Q(s', a*; θ⁻), with a* by θ in Double DQN, else by θ⁻. `mirror` evaluates at σs'.
  online_.Forward(config_.double_q ? online_.theta() : theta_target_, s_next, rows, q_select);
  if (config_.off_policy.mirror) {
    ForwardMirrored(s_next, rows, q_target);
  } else if (config_.double_q) {
    online_.Forward(theta_target_, s_next, rows, q_target);
  }
  TdTargets(q_select.Rows(rows.first, rows.count), q_target.Rows(rows.first, rows.count),
            Part(batch.reward, rows), Part(batch.discount, rows), Part(y_, rows));

  // dL/dQ(s, a) = w clip(Q(s, a; θ) - y, ±1) / B, and 0 for all other actions
  online_.Forward(s, rows, q);
  std::ranges::fill(dq.Rows(rows.first, rows.count).values(), 0.0F);
  for (int i = rows.first; i < rows.first + rows.count; ++i) {
    const int a = static_cast<int>(batch.action[i]);
    q_taken_[i] = q(i, a);
    td_error_[i] = q(i, a) - y_[i];
    dq(i, a) = batch.weight[i] * HuberGradient(td_error_[i]) / static_cast<float>(B_);
  }
  online_.Backward(dq, rows);
}

}  // namespace upswing
