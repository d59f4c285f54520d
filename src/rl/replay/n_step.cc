#include "rl/replay/n_step.h"

#include <algorithm>
#include <numeric>

namespace upswing {

NStep::NStep(int num_envs, int n, int obs_size, ActionSpace actions)
    : n_(n),
      actions_(actions),
      count_(num_envs),
      obs_(count_.size() * n_ * obs_size),
      action_(count_.size() * n_ * actions.size),
      reward_(count_.size() * n_),
      discount_(reward_.size()) {}

void NStep::Push(int env, const Transition& step, bool done, Replay& replay) {
  const auto last = static_cast<int>(count_[env]++);
  std::ranges::copy(step.obs, Waiting(obs_, env).row(last).begin());
  std::ranges::copy(step.action, Waiting(action_, env).row(last).begin());
  Waiting(reward_, env)(last, 0) = step.reward;
  Waiting(discount_, env)(last, 0) = step.discount;
  Complete(env, step.next_obs, done, replay);
}

void NStep::Complete(int env, std::span<const float> next_obs, bool done, Replay& replay) {
  const Matrix<float> obs = Waiting(obs_, env), action = Waiting(action_, env);
  const Matrix<double> reward = Waiting(reward_, env), discount = Waiting(discount_, env);

  // A full window adds its oldest step. The end of an episode adds all waiting steps.
  auto k = static_cast<int>(count_[env]);
  int first = 0;
  while (k == n_ || (done && k > 0)) {
    double sum = 0, product = 1;
    for (int i = first + k; i-- > first;) {
      sum = reward(i, 0) + discount(i, 0) * sum;
      product *= discount(i, 0);
    }
    replay.Add({obs.row(first), next_obs, action.row(first), sum, product});
    --k;
    ++first;
  }

  // Move the steps that still wait to the front.
  count_[env] = k;
  const auto to_front = [&](const auto& rows) {
    std::ranges::copy(rows.Rows(first, n_ - first).values(), rows.data());
  };
  if (first == 0) return;
  to_front(obs);
  to_front(action);
  to_front(reward);
  to_front(discount);
}

int64_t NStep::waiting() const { return std::accumulate(count_.begin(), count_.end(), int64_t{0}); }

void NStep::State(const Archive& archive) {
  archive.Array("count", std::span(count_), {0, n_ - 1});
  archive.Array("obs", std::span(obs_));
  archive.Array("action", std::span(action_));
  actions_.Check(archive, "action", action_);
  archive.Array("reward", std::span(reward_));
  archive.Array("discount", std::span(discount_), {0, 1});
}

}  // namespace upswing
