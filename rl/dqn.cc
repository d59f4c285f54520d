// Deep Q-Network (Mnih et al., 2015). Symbols: s observation, a action, r reward, γ discount,
// θ online and θ⁻ target parameters, y target, B batch size, A number of actions, D observation
// size, N environments.
#include "rl/dqn.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>

#include "core/argmax.h"
#include "core/error.h"
#include "core/text.h"
#include "nn/network_policy.h"
#include "rl/representation.h"
#include "rl/torque_levels.h"
#include "rl/trained_network.h"

namespace upswing {
namespace {

/// The actions of an agent for this task. Throws BadInput.
std::vector<double> TorquesOf(const DqnConfig& config, const EnvSpec& spec) {
  if (spec.action_size() == 1) return TorqueLevels(spec.action_limit.front(), config.levels);
  throw BadInput(
      Concat("dqn: expected a task with one torque, got ", spec.action_size(), " in ", spec.task));
}

}  // namespace

void TdTargets(Matrix<const float> select, Matrix<const float> evaluate,
               std::span<const float> reward, std::span<const float> discount, std::span<float> y) {
  for (int i = 0; i < select.rows(); ++i) {
    const auto row = static_cast<size_t>(i);
    y[row] = reward[row] + discount[row] * evaluate(i, ArgMax(select.row(i)));
  }
}

float HuberLoss(float delta) {
  const float size = std::abs(delta);
  return size <= 1 ? 0.5F * delta * delta : size - 0.5F;
}

float HuberGradient(float delta) { return std::clamp(delta, -1.0F, 1.0F); }

Dqn::Dqn(const DqnConfig& config, const EnvSpec& spec, uint64_t seed, ThreadPool& pool)
    : OffPolicyAgent(config, spec, ActionSpace::Discrete(static_cast<size_t>(config.levels)), seed,
                     pool),
      config_(config),
      obs_size_(static_cast<size_t>(spec.obs_size)),
      torques_(TorquesOf(config, spec)),
      pool_(pool),
      network_(config.Shape(spec.obs_size, static_cast<int>(torques_.size()))),
      theta_(network_.num_parameters()),
      adam_(network_.num_parameters()),
      activations_(network_.MakeActivations(static_cast<int>(config.batch), true)),
      q_(static_cast<size_t>(config.batch) * torques_.size()),
      q_select_(q_.size()),
      q_target_(q_.size()),
      dq_(q_.size()),
      y_(static_cast<size_t>(config.batch)),
      q_taken_(y_.size()),
      transposed_(network_.num_parameters()),
      gradient_(network_.num_parameters()),
      squares_(static_cast<size_t>(network_.num_tasks())),
      act_activations_(network_.MakeActivations(spec.num_envs, false)),
      act_q_(static_cast<size_t>(spec.num_envs) * torques_.size()) {
  Rng init_rng(seed, "initial parameters");
  network_.Initialize(init_rng, theta_);
  theta_target_ = theta_policy_ = theta_;
}

double Dqn::epsilon() const {
  const double decayed =
      config_.epsilon_start * std::pow(config_.epsilon_decay, static_cast<double>(episodes_));
  return std::max(decayed, config_.epsilon_end);
}

void Dqn::Act(Matrix<const float> obs, Matrix<double> action) {
  const Matrix<float> q(act_q_, obs.rows(), static_cast<int>(torques_.size()));
  network_.ForwardPreferences(theta_, obs, {0, obs.rows()}, act_activations_, q);
  Remember(obs);

  // ε-greedy.
  for (int env = 0; env < obs.rows(); ++env) {
    const bool random = explore_rng_.Uniform() < epsilon();
    const int chosen =
        random ? static_cast<int>(explore_rng_.Below(torques_.size())) : ArgMax(q.row(env));
    act_action_[static_cast<size_t>(env)] = static_cast<float>(chosen);
    action(env, 0) = torques_[static_cast<size_t>(chosen)];
  }
}

void Dqn::Update(const Minibatch& batch) {
  // Gradient of the mean Huber loss. Threads share the weights (to copy them into the layouts that
  // the products read), then slices of the batch, then the weights again.
  const int B = static_cast<int>(config_.batch);
  pool_.ParallelFor(network_.num_tasks(),
                    [&](int task) { network_.TransposeWeights(task, theta_, transposed_); });
  ForSlices(pool_, B, [&](RowRange rows) { BackwardRows(batch, rows); });
  CountErrors(batch);
  const Matrix<const float> s(batch.obs.data(), B, static_cast<int>(obs_size_));
  pool_.ParallelFor(network_.num_tasks(), [&](int task) {
    squares_[static_cast<size_t>(task)] =
        network_.BackwardWeights(task, s, activations_, gradient_);
  });
  const double norm = std::sqrt(std::accumulate(squares_.begin(), squares_.end(), 0.0));

  // θ moves against the gradient, and θ⁻ follows θ.
  const bool polyak = config_.target_period == 0;
  adam_.Step({learning_rate(), norm, config_.max_gradient_norm, polyak ? config_.tau : 0.0},
             gradient_, theta_, theta_target_, pool_);
  ++updates_;
  if (!polyak && updates_ % config_.target_period == 0) theta_target_ = theta_;
  if (config_.policy_tau < 1) AveragePolicy();
  norm_sum_ += norm;
  ++report_updates_;
}

void Dqn::AveragePolicy() {
  const auto tau = static_cast<float>(AveragingTau(config_.policy_tau));
  for (size_t i = 0; i < theta_.size(); ++i) {
    theta_policy_[i] += tau * (theta_[i] - theta_policy_[i]);
  }
}

void Dqn::BackwardRows(const Minibatch& batch, RowRange rows) {
  const int B = static_cast<int>(config_.batch);
  const int actions = static_cast<int>(torques_.size());
  const int obs_size = static_cast<int>(obs_size_);
  // s, s' (B × D); all Q-values (B × A)
  const Matrix<const float> s(batch.obs.data(), B, obs_size);
  const Matrix<const float> s_next(batch.next_obs.data(), B, obs_size);
  const Matrix<float> q(q_, B, actions);
  const Matrix<float> q_select(config_.double_q ? q_select_ : q_target_, B, actions);
  const Matrix<float> q_target(q_target_, B, actions);
  const Matrix<float> dq(dq_, B, actions);
  const auto part = [&](auto& values) {
    return std::span(values).subspan(static_cast<size_t>(rows.first),
                                     static_cast<size_t>(rows.count));
  };

  // y = r + γⁿ Q(s', a*; θ⁻)
  network_.Forward(theta_target_, s_next, rows, activations_, q_target);
  if (config_.double_q) network_.Forward(theta_, s_next, rows, activations_, q_select);
  TdTargets(q_select.Rows(rows.first, rows.count), q_target.Rows(rows.first, rows.count),
            part(batch.reward), part(batch.discount), part(y_));

  // dL/dQ(s, a) = w clip(Q(s, a; θ) - y, ±1) / B, and 0 for all other actions
  network_.Forward(theta_, s, rows, activations_, q);
  std::ranges::fill(dq.Rows(rows.first, rows.count).values(), 0.0F);
  for (int i = rows.first; i < rows.first + rows.count; ++i) {
    const auto row = static_cast<size_t>(i);
    const int a = static_cast<int>(batch.action[row]);
    q_taken_[row] = q(i, a);
    td_error_[row] = q(i, a) - y_[row];
    dq(i, a) = batch.weight[row] * HuberGradient(td_error_[row]) / static_cast<float>(B);
  }
  network_.BackwardInputs(theta_, transposed_, dq, rows, activations_);
}

void Dqn::CountErrors(const Minibatch& batch) {
  const double B = static_cast<double>(config_.batch);
  double loss = 0, q = 0, td = 0;
  for (size_t i = 0; i < y_.size(); ++i) {
    loss += batch.weight[i] * HuberLoss(td_error_[i]);
    q += q_taken_[i];
    td += std::abs(td_error_[i]);
  }
  loss /= B;
  if (!std::isfinite(loss)) {
    throw Failure(
        Concat("the loss is ", loss, " in update ", updates_ + 1, ", expected a finite number"));
  }
  loss_sum_ += loss;
  q_sum_ += q / B;
  td_sum_ += td / B;
}

Metrics Dqn::TakeMetrics() {
  const double n = static_cast<double>(std::max<int64_t>(1, report_updates_));
  Metrics metrics{{"updates", static_cast<double>(updates_)},
                  {"epsilon", epsilon()},
                  {"learning_rate", learning_rate()},
                  {"loss", loss_sum_ / n},
                  {"q", q_sum_ / n},
                  {"td_error", td_sum_ / n},
                  {"gradient_norm", norm_sum_ / n}};
  AddFeatureMetrics(network_.Features(activations_), config_.batch, config_.hidden.back(), metrics);
  loss_sum_ = q_sum_ = td_sum_ = norm_sum_ = 0;
  report_updates_ = 0;
  return metrics;
}

std::unique_ptr<Policy> Dqn::ExportPolicy(PolicyInfo info) const {
  info.gamma = config_.gamma;
  info.reward_scale = config_.reward_scale;
  const auto& theta = config_.policy_tau < 1 ? theta_policy_ : theta_;
  return std::make_unique<NetworkPolicy>(
      NetworkPolicyParts{ActionRule::kLevels, network_.shape(), theta, torques_}, std::move(info));
}

void Dqn::State(const Archive& archive) {
  constexpr Bounds<double> kSum{0, std::numeric_limits<double>::max()};
  archive.Array("theta", std::span(theta_));
  archive.Array("theta_target", std::span(theta_target_));
  if (config_.policy_tau < 1) archive.Array("theta_policy", std::span(theta_policy_));
  adam_.State(archive.In("adam"));
  SharedState(archive);
  archive.Check(adam_.steps() == updates_, "adam/steps", "one for each update");
  archive.Scalar("report_updates", report_updates_, {0, updates_});
  archive.Scalar("loss_sum", loss_sum_, kSum);
  archive.Scalar("q_sum", q_sum_, kAnyNumber<double>);
  archive.Scalar("td_sum", td_sum_, kSum);
  archive.Scalar("norm_sum", norm_sum_, kSum);
  archive.Array("last_features", std::span(network_.Features(activations_)));
}

}  // namespace upswing
