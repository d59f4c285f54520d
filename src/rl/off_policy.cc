#include "rl/off_policy.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "base/error.h"
#include "base/text.h"
#include "rl/replay/mirror.h"
#include "rl/schedule.h"

namespace upswing {

OffPolicyAgent::OffPolicyAgent(const OffPolicyConfig& config, const EnvSpec& spec,
                               const ActionSpace& actions, uint64_t seed, ThreadPool& pool)
    : pool_(pool),
      update_threads_(&pool),
      explore_rng_(seed, "exploration"),
      act_obs_(static_cast<size_t>(spec.num_envs) * spec.obs_size),
      act_action_(static_cast<size_t>(spec.num_envs) * actions.size),
      mirror_signs_(spec.mirror_signs),
      td_error_(config.batch),
      action_space_(actions),
      sample_rng_(seed, "replay sampling"),
      replay_(config.replay, spec.obs_size, actions, config.prioritized),
      n_step_(spec.num_envs, static_cast<int>(config.n_step), spec.obs_size, actions),
      batch_(static_cast<int>(config.batch), spec.obs_size, actions.size) {
  CheckMirror(config.mirror, spec);
}

double OffPolicyAgent::learning_rate() const {
  return Scheduled(off_policy().learning_rate, off_policy().learning_rate_end, steps_,
                   off_policy().learning_rate_steps);
}

double OffPolicyAgent::importance_exponent() const {
  return Scheduled(off_policy().importance_exponent, 1.0, steps_, off_policy().learning_rate_steps);
}

double OffPolicyAgent::AveragingTau(double tau) const {
  const double initial = off_policy().learning_rate;
  return initial > 0 ? std::min(tau, tau * learning_rate() / initial) : tau;
}

void OffPolicyAgent::Store(int env, const Transition& step, bool done) {
  n_step_.Push(env, step, done, replay_);
  ++steps_;
  if (done) ++episodes_;
}

void OffPolicyAgent::Truncate(Matrix<const float> obs) {
  for (int env = 0; env < obs.rows(); ++env) n_step_.Truncate(env, obs.row(env), replay_);
}

int64_t OffPolicyAgent::updates_due() const {
  const int64_t learning_steps = steps_ - off_policy().learning_starts;
  if (learning_steps <= 0 || replay_.size() == 0) return 0;
  return static_cast<int64_t>(static_cast<double>(learning_steps) * off_policy().updates_per_step);
}

const Minibatch& OffPolicyAgent::Sample() {
  if (off_policy().prioritized) {
    replay_.SamplePrioritized(sample_rng_, importance_exponent(), pool_, batch_);
  } else {
    replay_.Sample(sample_rng_, batch_);
  }
  if (off_policy().mirror) MirrorHalf(sample_rng_, mirror_signs_, action_space_, batch_);
  return batch_;
}

void OffPolicyAgent::UpdatePriorities() {
  if (off_policy().prioritized)
    replay_.Prioritize(batch_, td_error_, off_policy().priority_exponent);
}

float OffPolicyAgent::CenteringShift(const Minibatch& batch, double errors) const {
  // A shift of all values by x changes each error by (1 - γⁿ) x.
  double per_shift = 0;
  for (size_t i = 0; i < batch.weight.size(); ++i) {
    per_shift += double{batch.weight[i]} * (1 - batch.discount[i]);
  }
  return per_shift > 0 ? static_cast<float>(-off_policy().reward_centering * errors / per_shift)
                       : 0;
}

void OffPolicyAgent::CountErrors(double loss, double q, double td_error) {
  if (!std::isfinite(loss)) {
    throw Failure(
        Concat("the loss is ", loss, " in update ", updates_ + 1, ", expected a finite number"));
  }
  loss_sum_ += loss;
  q_sum_ += q;
  td_sum_ += td_error;
  ++report_updates_;
}

void OffPolicyAgent::TakeMeans(Metrics& metrics) {
  const double n = static_cast<double>(std::max<int64_t>(1, report_updates_));
  const auto take = [&](const char* name, double& sum) {
    metrics.emplace_back(name, sum / n);
    sum = 0;
  };
  take("loss", loss_sum_);
  take("q", q_sum_);
  take("td_error", td_sum_);
  take("gradient_norm", norm_sum_);
  report_updates_ = 0;
}

void OffPolicyAgent::SharedState(const Archive& archive) {
  constexpr int64_t kMostUpdates = 100 * kMostSteps;  // updates_per_step is at most 100
  replay_.State(archive.In("replay"));
  n_step_.State(archive.In("n_step"));
  explore_rng_.State(archive.In("explore_rng"));
  sample_rng_.State(archive.In("sample_rng"));
  archive.Scalar("steps", steps_, {0, kMostSteps});
  archive.Check(replay_.size() == std::min(replay_.capacity(), steps_ - n_step_.waiting()),
                "replay/rows", "one transition for each step, or a full memory");
  archive.Scalar("episodes", episodes_, {0, steps_});
  archive.Scalar("updates", updates_, {0, kMostUpdates});
  archive.Check(updates_ == updates_due(), "updates",
                Concat(updates_due(), ", which the steps imply"));
  constexpr Bounds<double> kSum{0, std::numeric_limits<double>::max()};
  archive.Scalar("report_updates", report_updates_, {0, updates_});
  archive.Scalar("loss_sum", loss_sum_, kSum);
  archive.Scalar("q_sum", q_sum_, kAnyNumber<double>);
  archive.Scalar("td_sum", td_sum_, kSum);
  archive.Scalar("norm_sum", norm_sum_, kSum);
}

}  // namespace upswing
