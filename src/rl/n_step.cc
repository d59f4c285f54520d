#include "rl/n_step.h"

#include <algorithm>
#include <cmath>
#include <numeric>

namespace upswing {

NStep::NStep(int num_envs, int n, double gamma, int obs_size, ActionSpace actions)
    : n_(n),
      obs_size_(obs_size),
      action_size_(actions.size),
      gamma_(gamma),
      actions_(actions),
      count_(num_envs),
      obs_(count_.size() * n_ * obs_size_),
      action_(count_.size() * n_ * action_size_),
      reward_(count_.size() * n_) {}

void NStep::Push(int env, const Transition& step, bool done, Replay& replay) {
  const auto e = static_cast<size_t>(env);
  const auto waiting_obs = std::span(obs_).subspan(e * n_ * obs_size_, n_ * obs_size_);
  const auto waiting_action = std::span(action_).subspan(e * n_ * action_size_, n_ * action_size_);
  const auto waiting_reward = std::span(reward_).subspan(e * n_, n_);

  const auto last = static_cast<size_t>(count_[e]++);
  std::ranges::copy(step.obs, waiting_obs.begin() + static_cast<ptrdiff_t>(last * obs_size_));
  std::ranges::copy(step.action,
                    waiting_action.begin() + static_cast<ptrdiff_t>(last * action_size_));
  waiting_reward[last] = step.reward;
  Complete(env, step.next_obs, step.discount == 0, done, replay);
}

void NStep::Complete(int env, std::span<const float> next_obs, bool terminal, bool done,
                     Replay& replay) {
  const auto e = static_cast<size_t>(env);
  const auto waiting_obs = std::span(obs_).subspan(e * n_ * obs_size_, n_ * obs_size_);
  const auto waiting_action = std::span(action_).subspan(e * n_ * action_size_, n_ * action_size_);
  const auto waiting_reward = std::span(reward_).subspan(e * n_, n_);

  // A full window adds its oldest step. The end of an episode adds all waiting steps.
  auto k = static_cast<size_t>(count_[e]);
  size_t first = 0;
  for (; k == n_ || (done && k > 0); --k, ++first) {
    double sum = 0;
    for (size_t i = k; i-- > 0;) sum = waiting_reward[first + i] + gamma_ * sum;
    const double discount = terminal ? 0.0 : std::pow(gamma_, static_cast<double>(k));
    replay.Add({waiting_obs.subspan(first * obs_size_, obs_size_), next_obs,
                waiting_action.subspan(first * action_size_, action_size_), sum, discount});
  }

  // Move the steps that still wait to the front.
  count_[e] = static_cast<int64_t>(k);
  if (first == 0) return;
  std::ranges::copy(waiting_obs.subspan(first * obs_size_), waiting_obs.begin());
  std::ranges::copy(waiting_action.subspan(first * action_size_), waiting_action.begin());
  std::ranges::copy(waiting_reward.subspan(first), waiting_reward.begin());
}

int64_t NStep::waiting() const { return std::accumulate(count_.begin(), count_.end(), int64_t{0}); }

void NStep::State(const Archive& archive) {
  archive.Array("count", std::span(count_), {0, static_cast<int64_t>(n_) - 1});
  archive.Array("obs", std::span(obs_));
  archive.Array("action", std::span(action_));
  actions_.Check(archive, "action", action_);
  archive.Array("reward", std::span(reward_));
}

}  // namespace upswing
