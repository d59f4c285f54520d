#include "rl/dqn_config.h"

namespace upswing {

void DqnConfig::Describe(Options& o) {
  o.Section("network");
  o.Add(&hidden, "hidden", {256, 256}, {1, 4096}, "widths of the feature layers");
  o.Add(&head, "head", 128, {1, 4096}, "", "width of each dueling stream's hidden layer");
  o.Add(&layer_norm, "layer_norm", true, "layer normalisation after each feature layer");
  o.AddChoice(&precision, "precision", {"float32", "bfloat16"},
              "of the products while learning; bfloat16 needs AVX512_BF16");

  o.Section("agent");
  o.Add(&double_q, "double", true, "Double DQN: choose online, evaluate with the target");
  o.Add(&dueling, "dueling", true, "Dueling: Q = V + A - mean(A)");
  o.Add(&levels, "levels", 9, {2, 1001}, "torques", "that the agent chooses from, evenly spaced")
      .implied = true;
  o.Add(&gamma, "gamma", 0.99, kUnit, "", "discount per control step");
  o.Add(&n_step, "n_step", 3, {1, 100}, "steps", "length of the returns in the targets");
  o.Add(&reward_scale, "reward_scale", 0.1, kPositive, "",
        "the agent learns from reward times this");
  o.Add(&batch, "batch", 128, {1, 65536}, "", "transitions in a minibatch");
  o.Add(&replay, "replay", 300000, {1, 10000000}, "", "transitions that the replay memory holds");
  o.Add(&prioritized, "prioritized", true,
        "prioritised replay: draw transitions by their last |TD error|");
  o.Add(&priority_exponent, "priority_exponent", 0.6, kUnit, "",
        "alpha of prioritised replay; 0: uniform");
  o.Add(&importance_exponent, "importance_exponent", 0.4, kUnit, "",
        "beta of prioritised replay at the beginning; it rises to 1 over learning_rate_steps");
  o.Add(&mirror, "mirror", true,
        "mirror a random half of each minibatch, observations and actions");
  o.Add(&learning_starts, "learning_starts", 2000, kNotNegative, "steps",
        "before the first update");
  o.Add(&updates_per_step, "updates_per_step", 0.0625, {0, 100}, "", "gradient steps per step");
  o.Add(&learning_rate, "learning_rate", 1e-3, {0, 10}, "",
        "learning rate of Adam at the beginning");
  o.Add(&learning_rate_end, "learning_rate_end", 2e-5, {0, 10}, "", "and at the end");
  o.Add(&learning_rate_steps, "learning_rate_steps", 250000, {1, 1e12}, "steps",
        "over which it falls linearly");
  o.Add(&max_gradient_norm, "max_gradient_norm", 10, kPositive, "", "clip the global norm to this");
  o.Add(&tau, "tau", 0.02, kUnit, "", "Polyak averaging of the target, per update");
  o.Add(&target_period, "target_period", 0, {0, 1e9}, "updates",
        "copy the target every so many instead; 0: Polyak averaging");
  o.Add(&policy_tau, "policy_tau", 0.01, {1e-9, 1}, "",
        "Polyak averaging of the policy that is judged and kept, per update, which falls with the "
        "learning rate; 1: as learned last");
  o.Add(&epsilon_start, "epsilon_start", 1.0, kUnit, "",
        "share of random actions at the beginning");
  o.Add(&epsilon_end, "epsilon_end", 0.05, kUnit, "", "and at least");
  o.Add(&epsilon_decay, "epsilon_decay", 0.97, kUnit, "", "factor per episode");
}

QNetworkShape DqnConfig::Shape(int obs_size, int actions) const {
  return {obs_size, actions, hidden, dueling ? head : 0, dueling, layer_norm};
}

}  // namespace upswing
