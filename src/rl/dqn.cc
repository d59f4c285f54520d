// Deep Q-Network (Mnih et al., 2015). Symbols: s observation, a action, r reward, γ discount,
// θ online and θ⁻ target parameters, y target, B batch size, A number of actions, D observation
// size, N environments.
#include "rl/dqn.h"

#include <algorithm>
#include <cmath>

#include "base/argmax.h"
#include "base/error.h"
#include "base/text.h"
#include "nn/network_policy.h"
#include "rl/representation.h"
#include "rl/torque_levels.h"

namespace upswing {
namespace {

/// The actions of an agent for this task. Throws BadInput if the task has several torques.
std::vector<double> TorquesOf(const DqnConfig& config, const EnvSpec& spec) {
  if (spec.action_size() == 1) return ActionTable(spec, config.levels);
  throw BadInput(
      Concat("dqn: expected a task with one torque, got ", spec.action_size(), " in ", spec.task));
}

}  // namespace

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

Dqn::Dqn(const DqnConfig& config, const EnvSpec& spec, uint64_t seed, ThreadPool& pool)
    : OffPolicyAgent(config, spec, ActionSpace::Discrete(TorquesOf(config, spec).size()), seed,
                     pool),
      config_(config),
      D_(spec.obs_size),
      B_(static_cast<int>(config.batch)),
      torques_(TorquesOf(config, spec)),
      online_(config.Shape(D_, static_cast<int>(torques_.size())), B_,
              Rng(seed, "initial parameters")),
      theta_target_(online_.theta().begin(), online_.theta().end()),
      theta_policy_(theta_target_),
      q_(static_cast<size_t>(B_) * torques_.size()),
      q_select_(q_.size()),
      q_target_(q_.size()),
      dq_(q_.size()),
      mirrored_(static_cast<size_t>(B_) * D_),
      y_(B_),
      q_taken_(y_.size()),
      act_activations_(online_.network().MakeActivations(spec.num_envs, false)),
      act_q_(static_cast<size_t>(spec.num_envs) * torques_.size()) {}

double Dqn::epsilon() const {
  const double decayed =
      config_.epsilon_start * std::pow(config_.epsilon_decay, static_cast<double>(episodes_));
  return std::max(decayed, config_.epsilon_end);
}

void Dqn::Act(Matrix<const float> obs, Matrix<double> action) {
  const Matrix<float> q(act_q_, obs.rows(), static_cast<int>(torques_.size()));
  online_.network().ForwardPreferences(online_.theta(), obs, {0, obs.rows()}, act_activations_, q);
  Remember(obs);

  // Act ε-greedily.
  for (int env = 0; env < obs.rows(); ++env) {
    const bool random = explore_rng_.Uniform() < epsilon();
    const int chosen =
        random ? static_cast<int>(explore_rng_.Below(torques_.size())) : ArgMax(q.row(env));
    act_action_[env] = static_cast<float>(chosen);
    action(env, 0) = torques_[chosen];
  }
}

void Dqn::Update(const Minibatch& batch) {
  // Compute the gradient of the mean Huber loss.
  online_.Prepare(pool_);
  ForSlices(pool_, B_, [&](RowRange rows) { BackwardRows(batch, rows); });
  double loss = 0, q = 0, td = 0, errors = 0;
  for (int i = 0; i < B_; ++i) {
    loss += batch.weight[i] * HuberLoss(td_error_[i]);
    q += q_taken_[i];
    td += std::abs(td_error_[i]);
    errors += double{batch.weight[i]} * HuberGradient(td_error_[i]);
  }
  CountErrors(loss / B_, q / B_, td / B_);

  // Move θ against the gradient, and θ⁻ towards θ.
  const bool polyak = config_.target_period == 0;
  norm_sum_ += online_.Step({batch.obs.data(), B_, D_}, learning_rate(), config_.max_gradient_norm,
                            theta_target_, polyak ? config_.tau : 0.0, pool_);
  ++updates_;
  if (!polyak && updates_ % config_.target_period == 0) {
    std::ranges::copy(online_.theta(), theta_target_.begin());
  }
  if (config_.policy_tau < 1) AveragePolicy();
  if (config_.reward_centering > 0) ShiftValues(CenteringShift(batch, errors));
}

void Dqn::ShiftValues(float shift) {
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

void Dqn::ForwardMirrored(Matrix<const float> s, RowRange rows, Matrix<float> q) {
  const Matrix<float> mirrored(mirrored_, B_, D_);
  for (int i = rows.first; i < rows.first + rows.count; ++i) {
    for (int k = 0; k < D_; ++k) mirrored(i, k) = mirror_signs_[k] * s(i, k);
  }
  online_.Forward(theta_target_, mirrored, rows, q);
  for (int i = rows.first; i < rows.first + rows.count; ++i) std::ranges::reverse(q.row(i));
}

void Dqn::BackwardRows(const Minibatch& batch, RowRange rows) {
  const int A = static_cast<int>(torques_.size());
  const Matrix<const float> s(batch.obs.data(), B_, D_), s_next(batch.next_obs.data(), B_, D_);
  const Matrix<float> q(q_, B_, A), q_target(q_target_, B_, A), dq(dq_, B_, A);
  const Matrix<float> q_select(config_.double_q || config_.mirror ? q_select_ : q_target_, B_, A);

  // y = r + γⁿ Q(s', a*; θ⁻), or with mirror y = r + γⁿ Q(σs', σa*; θ⁻). θ selects a* in Double
  // DQN, θ⁻ otherwise.
  online_.Forward(config_.double_q ? online_.theta() : theta_target_, s_next, rows, q_select);
  if (config_.mirror) {
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

Metrics Dqn::TakeMetrics() {
  Metrics metrics{{"updates", static_cast<double>(updates_)},
                  {"epsilon", epsilon()},
                  {"learning_rate", learning_rate()}};
  TakeMeans(metrics);
  AddFeatureMetrics(online_.features(), B_, config_.hidden.back(), metrics);
  return metrics;
}

std::unique_ptr<Policy> Dqn::ExportPolicy(PolicyInfo info) const {
  info.gamma = config_.gamma;
  info.reward_scale = config_.reward_scale;
  NetworkPolicyParts parts{ActionRule::kLevels, online_.network().shape()};
  const std::span<const float> theta = config_.policy_tau < 1 ? theta_policy_ : online_.theta();
  parts.parameters.assign(theta.begin(), theta.end());
  parts.torques = torques_;
  return std::make_unique<NetworkPolicy>(std::move(parts), std::move(info));
}

void Dqn::State(const Archive& archive) {
  online_.State(archive);
  archive.Array("theta_target", std::span(theta_target_));
  if (config_.policy_tau < 1) archive.Array("theta_policy", std::span(theta_policy_));
  SharedState(archive);
  archive.Check(online_.steps() == updates_, "adam/steps", "one for each update");
}

}  // namespace upswing
