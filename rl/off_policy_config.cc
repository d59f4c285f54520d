#include "rl/off_policy_config.h"

#include "core/error.h"
#include "core/format.h"
#include "core/text.h"
#include "rl/agent_config.h"

namespace upswing {

void OffPolicyConfig::Describe(Options& o) {
  o.Add(&gamma, "gamma", kUnit, "", "discount per control step");
  o.Add(&n_step, "n_step", {1, 100}, "steps", "length of the returns in the targets");
  o.Add(&reward_scale, "reward_scale", kPositive, "", "the agent learns from reward times this");
  o.Add(&batch, "batch", {1, 65536}, "", "transitions in a minibatch");
  o.Add(&replay, "replay", {1, 10000000}, "", "transitions that the replay memory holds");
  o.Add(&prioritized, "prioritized",
        "prioritised replay: draw transitions by their last |TD error|");
  o.Add(&priority_exponent, "priority_exponent", kUnit, "",
        "alpha of prioritised replay; 0: uniform");
  o.Add(&importance_exponent, "importance_exponent", kUnit, "",
        "beta of prioritised replay at the beginning; it rises to 1 over learning_rate_steps");
  o.Add(&mirror, "mirror",
        "mirror a random half of each minibatch; DQN also evaluates targets at mirrored states");
  o.Add(&reward_centering, "reward_centering", kUnit, "",
        "fraction of the mean TD error that each update removes by shifting all values, for gamma "
        "near 0.99; 0 or a categorical critic: off");
  o.Add(&learning_starts, "learning_starts", kNotNegative, "steps",
        "steps before the first update");
  o.Add(&updates_per_step, "updates_per_step", {0, 100}, "", "gradient steps per step");
  o.Add(&learning_rate, "learning_rate", {0, 10}, "", "learning rate of Adam at the beginning");
  o.Add(&learning_rate_end, "learning_rate_end", {0, 10}, "", "learning rate at the end");
  o.Add(&learning_rate_steps, "learning_rate_steps", {1, 1e12}, "steps",
        "over which the learning rate falls linearly");
  o.Add(&max_gradient_norm, "max_gradient_norm", kPositive, "", "clip the global norm to this");
}

void OffPolicyConfig::Check() const {
  if (batch > replay) {
    throw BadInput(
        Concat("batch: expected at most as many transitions as the replay memory holds (replay ",
               replay, "), got ", batch));
  }
  if (learning_starts > replay) {
    throw BadInput(Concat("learning_starts: expected at most as many steps as the replay memory ",
                          "holds transitions (replay ", replay, "), got ", learning_starts));
  }
}

std::vector<std::string> OffPolicyConfig::Warnings(int64_t steps) const {
  std::vector<std::string> warnings;
  if (learning_starts >= steps) {
    warnings.push_back(Concat("learning starts after step ", FormatCount(learning_starts),
                              ", and there are ", FormatCount(steps),
                              " steps: nothing will be learned"));
  }
  if (updates_per_step == 0) {
    warnings.emplace_back("updates_per_step is 0: nothing will be learned");
  }
  if (reward_centering > 0 && gamma > 0.995) {
    warnings.push_back(Concat("reward_centering divides by 1 - gamma: with gamma ",
                              FormatNumber(gamma), ", ", FormatNumber(reward_centering),
                              " may be too much, and values overshoot"));
  }
  WarnOfNoRate(learning_rate, learning_rate_end, warnings);
  return warnings;
}

}  // namespace upswing
