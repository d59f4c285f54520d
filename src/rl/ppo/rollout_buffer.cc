#include "rl/ppo/rollout_buffer.h"

#include <algorithm>

#include "rl/agent.h"

namespace upswing {

RolloutBuffer::RolloutBuffer(int64_t steps, int num_envs, int obs_size, const ActionSpace& actions)
    : steps_(steps),
      num_envs_(num_envs),
      obs_size_(obs_size),
      actions_(actions),
      obs_(steps * num_envs * obs_size),
      next_obs_(obs_.size()),
      action_(steps * num_envs * actions.size),
      log_prob_(steps * num_envs),
      reward_(log_prob_.size()),
      terminated_(log_prob_.size()),
      truncated_(log_prob_.size()) {}

void RolloutBuffer::Add(const StepResult& result, double reward_scale) {
  std::ranges::copy(result.next_obs, Rows(next_obs_, obs_size_).values().begin());
  const auto first = static_cast<size_t>(filled_ * num_envs_);
  for (int env = 0; env < num_envs_; ++env) {
    const auto i = static_cast<size_t>(env);
    ExpectFinite(result, i);
    reward_[first + i] = static_cast<float>(reward_scale * result.reward[i]);
    terminated_[first + i] = result.terminated[i];
    truncated_[first + i] = result.truncated[i];
  }
  ++filled_;
}

void RolloutBuffer::Truncate() {
  const auto rows = static_cast<size_t>(filled_ * num_envs_);
  for (size_t i = rows - std::min<size_t>(rows, num_envs_); i < rows; ++i) {
    truncated_[i] = terminated_[i] == 0 ? 1 : 0;
  }
}

void RolloutBuffer::State(const Archive& archive) {
  archive.Scalar("filled", filled_, {0, steps_ - 1});
  const auto rows = static_cast<size_t>(filled_ * num_envs_);
  const auto part = [&](auto& values, int cols) {
    return std::span(values).first(rows * static_cast<size_t>(cols));
  };
  archive.Array("obs", part(obs_, obs_size_));
  archive.Array("next_obs", part(next_obs_, obs_size_));
  archive.Array("action", part(action_, actions_.size));
  actions_.Check(archive, "action", part(action_, actions_.size));
  archive.Array("log_prob", part(log_prob_, 1));
  archive.Array("reward", part(reward_, 1));
  archive.Array("terminated", part(terminated_, 1), {0, 1});
  archive.Array("truncated", part(truncated_, 1), {0, 1});
}

}  // namespace upswing
