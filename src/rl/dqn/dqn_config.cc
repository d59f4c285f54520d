#include "rl/dqn/dqn_config.h"

#include <algorithm>

#include "base/text.h"

namespace upswing {

void DqnConfig::Describe(Options& o) {
  o.Section("network");
  o.Add(&hidden, "hidden", {1, 4096}, "widths of the hidden feature layers");
  o.Add(&head, "head", {1, 4096}, "", "width of the hidden layer of each dueling stream");
  o.Add(&layer_norm, "layer_norm", "apply layer normalisation after each feature layer");

  o.Section("agent");
  o.Add(&double_q, "double",
        "Double DQN: choose the next action online, value it with the target network");
  o.Add(&dueling, "dueling", "dueling network: Q = V + A - mean(A)");
  o.Add(&levels, "levels", {2, 1001}, "", "number of evenly spaced torque levels");
  off_policy.Describe(o);
  o.Add(&tau, "tau", kZeroToOne, "", "Polyak factor of the target network, per update");
  o.Add(&target_period, "target_period", {0, 1e9}, "updates",
        "copy the target network every N updates; 0: Polyak averaging");
  o.Add(&policy_tau, "policy_tau", {1e-9, 1}, "",
        "Polyak factor of the policy that is evaluated and saved, per update; decays with the "
        "learning rate; 1: no averaging");
  o.Add(&epsilon_start, "epsilon_start", kZeroToOne, "", "initial probability of a random action");
  o.Add(&epsilon_end, "epsilon_end", kZeroToOne, "", "lowest probability of a random action");
  o.Add(&epsilon_decay, "epsilon_decay", kZeroToOne, "",
        "factor on the probability of a random action after each episode");
}

void DqnConfig::Check(int64_t /*num_envs*/) const { off_policy.Check(); }

bool DqnConfig::FitToActions(int64_t choices) {
  if (choices > 0) levels = choices;
  return true;  // continuous actions become evenly spaced levels
}

AgentSize DqnConfig::Size(const EnvSpec& spec) const {
  const int D = spec.obs_size;
  const Network network(Shape(D, static_cast<int>(levels)));
  return {.parameters = static_cast<double>(network.num_parameters()),
          // Online, target and kept parameters, gradient, Adam's two moments, and transposed online
          // and target weights.
          .arrays = 8,
          .saved_arrays = 5,
          .transition = 2.0 * D + 3,  // s, s', a, r, discount
          .capacity = static_cast<double>(off_policy.replay),
          .batch = static_cast<double>(off_policy.batch),
          .widest = static_cast<double>(std::ranges::max(hidden)),
          .layers = 3 * static_cast<double>(hidden.size())};
}

std::string DqnConfig::Text() const {
  return Concat(double_q ? "double, " : "", dueling ? "dueling" : "plain", " network ",
                Join(hidden, "-"), dueling ? Concat(" with heads of ", head) : "");
}

std::vector<std::string> DqnConfig::Warnings(int64_t steps, int64_t /*num_envs*/) const {
  std::vector<std::string> warnings = off_policy.Warnings(steps);
  if (tau == 0 && target_period == 0) {
    warnings.emplace_back("tau is 0: the target network never changes");
  }
  return warnings;
}

NetworkShape DqnConfig::Shape(int obs_size, int actions) const {
  return {obs_size, hidden, actions, layer_norm, Activation::kRelu, dueling ? head : 0};
}

}  // namespace upswing
