#include "rl/sac_config.h"

namespace upswing {

void SacConfig::Describe(Options& o) {
  o.Section("network");
  o.Add(&hidden, "hidden", {1, 4096}, "widths of the feature layers of each network");
  o.Add(&layer_norm, "layer_norm", "layer normalisation after each feature layer");
  o.Add(&bins, "bins", {0, 1001}, "",
        "values of a categorical critic (HL-Gauss); 0: the critic puts out one number");
  o.Add(&value_low, "value_low", {-1e9, 1e9}, "", "least value of a categorical critic");
  o.Add(&value_high, "value_high", {-1e9, 1e9}, "", "largest value of a categorical critic");

  o.Section("agent");
  o.Add(&twin, "twin", "two critics, of which the smaller value counts");
  OffPolicyConfig::Describe(o);
  o.Add(&smoothness, "smoothness", {0, 1e6}, "",
        "the agent's reward falls by this times the squared change of its mean action, in units of "
        "the limit");
  o.Add(&actor_period, "actor_period", {1, 1e9}, "updates",
        "critic updates for each update of actor and temperature");
  o.Add(&actor_rate, "actor_rate", {0, 1000}, "", "the actor's learning rate over the critics'");
  o.Add(&tau, "tau", kUnit, "", "Polyak averaging of the target critics, per update");
  o.Add(&policy_tau, "policy_tau", {1e-9, 1}, "",
        "Polyak averaging of the policy that is judged and kept, per update of the actor, which "
        "falls with the learning rate; 1: as learned last");
  o.Add(&tune_alpha, "tune_alpha", "learn the temperature, so that entropy meets its target");
  o.Add(&alpha, "alpha", {0, 1e6}, "", "temperature, or what it begins with");
  o.Add(&alpha_rate, "alpha_rate", {0, 10}, "", "learning rate of its logarithm");
  o.Add(
      &target_entropy, "target_entropy", {-100, 0.69}, "nats",
      "entropy of each component of the action, in units of its limit; uniform actions have 0.69");
}

MlpShape SacConfig::Trunk(int inputs) const { return {inputs, hidden, layer_norm}; }

}  // namespace upswing
