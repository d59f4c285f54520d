// Soft Actor-Critic (Haarnoja et al., 2018). Symbols: see rl/sac/sac.h.
#include "rl/sac/sac.h"

#include <algorithm>
#include <cmath>

#include "base/text.h"
#include "nn/network_policy.h"
#include "rl/representation.h"

namespace upswing {

Sac::Sac(const SacConfig& config, const EnvSpec& spec, uint64_t seed, ThreadPool& pool)
    : OffPolicyAgent(config.off_policy, spec, ActionSpace{spec.action_size()}, seed, pool),
      config_(config),
      D_(spec.obs_size),
      A_(spec.action_size()),
      B_(static_cast<int>(config.off_policy.batch)),
      action_limit_(spec.action_limit),
      noise_rng_(seed, "policy noise"),
      actor_(config.Shape(D_, 2 * A_), B_, Rng(seed, "initial actor")),
      theta_policy_(actor_.theta().begin(), actor_.theta().end()),
      log_alpha_(1, static_cast<float>(std::max(double{-kMostLogAlpha}, std::log(config.alpha)))),
      alpha_adam_(1),
      actor_outputs_(Size(B_, 2 * A_)),
      actor_dy_(actor_outputs_.size()),
      samples_([&] {
        const AlignedVector<float> zeros(Size(B_, A_));
        return Samples{zeros, zeros, zeros, zeros, zeros, zeros};
      }()),
      log_prob_(B_),
      inputs_(Size(B_, D_ + A_)),
      policy_inputs_(inputs_.size()),
      y_(log_prob_.size()),
      act_activations_(actor_.network().MakeActivations(spec.num_envs, false)),
      act_outputs_(Size(spec.num_envs, 2 * A_)),
      mean_(act_action_.size()),
      last_mean_(act_action_.size()),
      begins_(spec.num_envs, 1) {
  for (size_t i = 0; i < num_critics(); ++i) {
    TrainedNetwork network(config.Shape(D_ + A_, 1), B_, Rng(seed, "initial critic", i));
    AlignedVector<float> target(network.theta().begin(), network.theta().end());
    const AlignedVector<float> zeros(B_);
    critics_.push_back({std::move(network), std::move(target), zeros, zeros, zeros, inputs_});
  }
}

double Sac::alpha() const { return std::exp(double{log_alpha_[0]}); }

void Sac::Act(Matrix<const float> obs, Matrix<double> action) {
  const Matrix<float> outputs(act_outputs_, obs.rows(), 2 * A_);
  ForSlices(pool_, obs.rows(), [&](RowRange rows) {
    actor_.network().Forward(actor_.theta(), obs, rows, act_activations_, outputs);
  });
  std::ranges::copy(obs.values(), act_obs_.begin());
  const bool random = steps_ < config_.off_policy.learning_starts;
  for (int env = 0; env < obs.rows(); ++env) {
    for (int k = 0; k < A_; ++k) {
      const auto i = Size(env, A_) + k;
      const auto policy = Gaussian<float>::From(outputs(env, k), outputs(env, A_ + k));
      const double u = policy.mean + policy.std * explore_rng_.Normal();
      const double chosen = random ? explore_rng_.Uniform(-1, 1) : std::tanh(u);
      act_action_[i] = static_cast<float>(chosen);
      action(env, k) = action_limit_[k] * act_action_[i];
      if (config_.smoothness > 0) mean_[i] = std::tanh(policy.mean);
    }
  }
}

double Sac::RoughnessOf(const StepResult& result, size_t env) {
  double roughness = 0;
  const auto A = static_cast<size_t>(A_);
  for (size_t i = env * A; i < (env + 1) * A; ++i) {
    const double change = double{mean_[i]} - last_mean_[i];
    if (begins_[env] == 0) roughness += config_.smoothness * change * change;
    last_mean_[i] = mean_[i];
  }
  begins_[env] = result.done(env) ? 1 : 0;
  return roughness;
}

void Sac::Observe(const StepResult& result) {
  const int N = static_cast<int>(begins_.size());
  const Matrix<const float> s(act_obs_.data(), N, D_), s_next(result.next_obs.data(), N, D_);
  const Matrix<const float> a(act_action_.data(), N, A_);
  for (int env = 0; env < N; ++env) {
    ExpectFinite(result, env);
    double r = config_.off_policy.reward_scale * result.reward[env];
    if (config_.smoothness > 0) r -= RoughnessOf(result, env);
    const double discount = result.terminated[env] != 0 ? 0 : config_.off_policy.gamma;
    Store(env, {s.row(env), s_next.row(env), a.row(env), r, discount}, result.done(env));
  }
}

void Sac::Learn() {
  while (UpdateIsDue()) {
    update_threads_.Run([&] { Update(Sample()); });
    UpdatePriorities();
  }
}

Metrics Sac::TakeMetrics() {
  const double actor_n = static_cast<double>(std::max<int64_t>(1, report_actor_updates_));
  Metrics metrics{{"updates", static_cast<double>(updates_)},
                  {"alpha", alpha()},
                  {"entropy", entropy_sum_ / actor_n},
                  {"learning_rate", learning_rate()}};
  TakeMeans(metrics);
  AddFeatureMetrics(critics_.front().network.features(), B_, config_.hidden.back(), metrics);
  entropy_sum_ = 0;
  report_actor_updates_ = 0;
  return metrics;
}

std::unique_ptr<NetworkPolicy> Sac::ExportPolicy(PolicyInfo info) const {
  info.gamma = config_.off_policy.gamma;
  info.reward_scale = config_.off_policy.reward_scale;
  NetworkPolicyParts parts{ActionRule::kSquashedGaussian, actor_.network().shape(), theta_policy_};
  parts.action_limit = action_limit_;
  parts.critic = config_.Shape(D_ + A_, 1);
  const std::span<const float> theta = critics_.front().network.theta();
  parts.critic_parameters.assign(theta.begin(), theta.end());
  return std::make_unique<NetworkPolicy>(std::move(parts), std::move(info));
}

void Sac::State(const Archive& archive) {
  constexpr Bounds<float> kUnitRange{-1, 1};
  actor_.State(archive.In("actor"));
  archive.Array("theta_policy", std::span(theta_policy_));
  for (size_t i = 0; i < critics_.size(); ++i) {
    const Archive in = archive.In(Concat("critic", i + 1));
    critics_[i].network.State(in);
    in.Array("theta_target", std::span(critics_[i].target));
  }
  archive.Array("log_alpha", std::span(log_alpha_), {-kMostLogAlpha, kMostLogAlpha});
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
  archive.Scalar("report_actor_updates", report_actor_updates_, {0, of_actor});
  archive.Scalar("entropy_sum", entropy_sum_, kAnyNumber<double>);
}

}  // namespace upswing
