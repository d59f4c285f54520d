#include "rl/off_policy_config.h"

#include "base/error.h"
#include "base/format.h"
#include "base/text.h"
#include "rl/agent_config.h"

namespace upswing {

void OffPolicyConfig::Describe(Options& o) {
  o.Add(&gamma, "gamma", kZeroToOne, "", "discount factor per control step");
  o.Add(&n_step, "n_step", {1, 100}, "steps", "length of the n-step returns in the targets");
  o.Add(&reward_scale, "reward_scale", kPositive, "",
        "factor on the reward that the agent learns from");
  o.Add(&batch, "batch", {1, 65536}, "transitions", "size of a minibatch");
  o.Add(&replay, "replay", {1, 10000000}, "transitions", "capacity of the replay memory");
  o.Add(&prioritized, "prioritized",
        "prioritised replay: draw transitions by their last absolute TD error");
  o.Add(&priority_exponent, "priority_exponent", kZeroToOne, "",
        "exponent alpha of prioritised replay; 0: uniform");
  o.Add(&importance_exponent, "importance_exponent", kZeroToOne, "",
        "initial exponent beta of prioritised replay; rises to 1 over learning_rate_steps");
  o.Add(&mirror, "mirror",
        "mirror a random half of each minibatch; DQN also evaluates targets at mirrored states");
  o.Add(&reward_centering, "reward_centering", kZeroToOne, "",
        "share of the mean TD error that each update removes by shifting all values, for gamma "
        "near 0.99; 0: off");
  o.Add(&learning_starts, "learning_starts", kNotNegative, "steps",
        "warm-up before the first update");
  o.Add(&updates_per_step, "updates_per_step", {0, 100}, "", "updates per control step");
  o.Add(&learning_rate, "learning_rate", {0, 10}, "", "initial learning rate of Adam");
  o.Add(&learning_rate_end, "learning_rate_end", {0, 10}, "", "final learning rate of Adam");
  o.Add(&learning_rate_steps, "learning_rate_steps", {1, 1e12}, "steps",
        "length of the linear decay of the learning rate");
  o.Add(&max_gradient_norm, "max_gradient_norm", kPositive, "",
        "largest global norm of the gradient, which is clipped to it");
}

void OffPolicyConfig::Check() const {
  if (batch > replay) {
    throw BadInput(Concat("batch: expected at most ", replay,
                          " transitions, the capacity of the replay memory (replay), got ", batch));
  }
  if (learning_starts > replay) {
    throw BadInput(Concat("learning_starts: expected at most ", replay,
                          " steps, the capacity of the replay memory (replay), got ",
                          learning_starts));
  }
}

std::vector<std::string> OffPolicyConfig::Warnings(int64_t steps) const {
  std::vector<std::string> warnings;
  if (learning_starts >= steps) {
    warnings.push_back(Concat("learning_starts is ", FormatCount(learning_starts),
                              " and the training has only ", FormatCount(steps),
                              " steps: the agent learns nothing"));
  }
  if (updates_per_step == 0) {
    warnings.emplace_back("updates_per_step is 0: the agent learns nothing");
  }
  if (reward_centering > 0 && gamma > 0.995) {
    warnings.push_back(Concat("reward_centering ", FormatNumber(reward_centering), " with gamma ",
                              FormatNumber(gamma), ": values may overshoot, because the shift is ",
                              "divided by 1 - gamma"));
  }
  WarnOfNoRate(learning_rate, learning_rate_end, warnings);
  return warnings;
}

}  // namespace upswing
