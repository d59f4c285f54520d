#include "rl/dqn_config.h"

namespace upswing {

void DqnConfig::Describe(Options& o) {
  o.Section("network");
  o.Add(&hidden, "hidden", {1, 4096}, "widths of the feature layers");
  o.Add(&head, "head", {1, 4096}, "", "width of each dueling stream's hidden layer");
  o.Add(&layer_norm, "layer_norm", "layer normalisation after each feature layer");

  o.Section("agent");
  o.Add(&double_q, "double", "Double DQN: choose online, evaluate with the target");
  o.Add(&dueling, "dueling", "Dueling: Q = V + A - mean(A)");
  o.Add(&levels, "levels", {2, 1001}, "torques", "that the agent chooses from, evenly spaced")
      .implied = true;
  OffPolicyConfig::Describe(o);
  o.Add(&tau, "tau", kUnit, "", "Polyak averaging of the target, per update");
  o.Add(&target_period, "target_period", {0, 1e9}, "updates",
        "copy the target every so many instead; 0: Polyak averaging");
  o.Add(&policy_tau, "policy_tau", {1e-9, 1}, "",
        "Polyak averaging of the policy that is judged and kept, per update, which falls with the "
        "learning rate; 1: as learned last");
  o.Add(&epsilon_start, "epsilon_start", kUnit, "", "share of random actions at the beginning");
  o.Add(&epsilon_end, "epsilon_end", kUnit, "", "what epsilon falls to");
  o.Add(&epsilon_decay, "epsilon_decay", kUnit, "", "factor per episode");
}

QNetworkShape DqnConfig::Shape(int obs_size, int actions) const {
  return {obs_size, actions, hidden, dueling ? head : 0, dueling, layer_norm};
}

}  // namespace upswing
