// The DQN agent's memory, metrics, policy and state. Symbols: see rl/dqn/dqn.h.
#include <algorithm>
#include <cmath>

#include "nn/network_policy.h"
#include "rl/dqn/dqn.h"
#include "rl/representation.h"
#include "rl/torque_levels.h"

namespace upswing {
Dqn::Dqn(const DqnConfig& config, const EnvSpec& spec, uint64_t seed, ThreadPool& pool)
    : OffPolicyAgent(config.off_policy, spec,
                     ActionSpace::Discrete(ActionTable(spec, config.levels, "dqn").size()), seed,
                     pool),
      config_(config),
      D_(spec.obs_size),
      B_(static_cast<int>(config.off_policy.batch)),
      torques_(ActionTable(spec, config.levels, "dqn")),
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

void Dqn::CountMinibatch(const Minibatch& batch) {
  double loss = 0, q = 0, td = 0;
  for (int i = 0; i < B_; ++i) {
    loss += batch.weight[i] * HuberLoss(td_error_[i]);
    q += q_taken_[i];
    td += std::abs(td_error_[i]);
  }
  CountErrors(loss / B_, q / B_, td / B_);
}

Metrics Dqn::TakeMetrics() {
  Metrics metrics{{"updates", static_cast<double>(updates_)},
                  {"epsilon", epsilon()},
                  {"learning_rate", learning_rate()}};
  TakeMeans(metrics);
  AddFeatureMetrics(online_.features(), B_, config_.hidden.back(), metrics);
  return metrics;
}

std::unique_ptr<NetworkPolicy> Dqn::ExportPolicy(PolicyInfo info) const {
  info.gamma = config_.off_policy.gamma;
  info.reward_scale = config_.off_policy.reward_scale;
  NetworkPolicyParts parts{ActionRule::kLevels, online_.network().shape()};
  const std::span<const float> theta = config_.policy_tau < 1 ? theta_policy_ : online_.theta();
  parts.parameters.assign(theta.begin(), theta.end());
  parts.torques = torques_;
  return std::make_unique<NetworkPolicy>(std::move(parts), std::move(info));
}

bool Dqn::StartFrom(const NetworkPolicyParts& policy) {
  return online_.StartFrom(policy, ActionRule::kLevels, {theta_target_, theta_policy_});
}

void Dqn::State(const Archive& archive) {
  online_.State(archive);
  archive.Array("theta_target", std::span(theta_target_));
  if (config_.policy_tau < 1) archive.Array("theta_policy", std::span(theta_policy_));
  SharedState(archive);
  archive.Check(online_.steps() == updates_, "adam/steps", "one for each update");
}

std::optional<UpdateExample> Dqn::LastUpdate() const {
  if (updates_ == 0 || q_taken_.empty()) return std::nullopt;
  const int a = static_cast<int>(batch().action[0]);
  std::vector<float> q(torques_.size());
  auto activations = online_.network().MakeActivations(1, false);
  online_.network().Forward(online_.theta(), {batch().obs.data(), 1, D_}, {0, 1}, activations,
                            {q.data(), 1, static_cast<int>(q.size())});
  return UpdateExample{
      torques_[a],     q_taken_[0],        q[a], batch().reward[0], y_[0], epsilon(),
      replay().size(), replay().capacity()};
}

}  // namespace upswing
