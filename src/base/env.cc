#include "base/env.h"

namespace upswing {

StepResult::StepResult(const EnvSpec& spec) {
  const auto n = static_cast<size_t>(spec.num_envs);
  next_obs.resize(n * static_cast<size_t>(spec.obs_size));
  reward.resize(n);
  reward_terms.resize(n * spec.term_names.size());
  torque.resize(n * spec.action_limit.size());
  work.resize(n);
  at_goal.resize(n);
  terminated.resize(n);
  truncated.resize(n);
}

}  // namespace upswing
