#include "rl/sac/sac_config.h"

#include <algorithm>

#include "base/text.h"

namespace upswing {

void SacConfig::Describe(Options& o) {
  o.Section("network");
  o.Add(&hidden, "hidden", {1, 4096}, "widths of the hidden layers of actor and critics");
  o.Add(&layer_norm, "layer_norm", "apply layer normalisation after each hidden layer");

  o.Section("agent");
  o.Add(&twin, "twin", "train two critics and use the smaller value");
  off_policy.Describe(o);
  o.Add(&smoothness, "smoothness", {0, 1e6}, "",
        "weight of the penalty on squared changes of the mean action, which is in units of its "
        "limit");
  o.Add(&actor_period, "actor_period", {1, 1e9}, "updates",
        "critic updates per update of actor and temperature");
  o.Add(&actor_rate, "actor_rate", {0, 1000}, "",
        "ratio of the actor's learning rate to the critics'");
  o.Add(&tau, "tau", kZeroToOne, "", "Polyak factor of the target critics, per update");
  o.Add(&policy_tau, "policy_tau", {1e-9, 1}, "",
        "Polyak factor of the policy that is evaluated and saved, per actor update; decays with "
        "the learning rate; 1: no averaging");
  o.Add(&entropy_reward, "entropy_reward",
        "add the entropy bonus to the critics' targets; false: only to the actor's loss");
  o.Add(&tune_alpha, "tune_alpha",
        "learn the temperature so that the entropy meets target_entropy");
  o.Add(&alpha, "alpha", {0, 1e6}, "", "temperature; with tune_alpha its initial value");
  o.Add(&alpha_rate, "alpha_rate", {0, 10}, "",
        "learning rate of the logarithm of the temperature");
  o.Add(&target_entropy, "target_entropy", {-100, 0.69}, "nats",
        "target entropy per action component in units of its limit; uniform actions have 0.69");
}

void SacConfig::Check(int64_t /*num_envs*/) const { off_policy.Check(); }

bool SacConfig::FitToActions(int64_t choices) { return choices == 0; }

AgentSize SacConfig::Size(const EnvSpec& spec) const {
  const int D = spec.obs_size, A = spec.action_size();
  const double critics = twin ? 2 : 1;
  const Network actor(Shape(D, 2 * A));
  const Network critic(Shape(D + A, 1));
  return {
      .parameters = static_cast<double>(actor.num_parameters()) +
                    critics * static_cast<double>(critic.num_parameters()),
      // Online, target or kept parameters, gradient, Adam's two moments, and transposed weights.
      .arrays = 6,
      .saved_arrays = 4,
      .transition = 2.0 * D + A + 2,  // s, s', a, r, discount
      .capacity = static_cast<double>(off_policy.replay),
      .batch = static_cast<double>(off_policy.batch),
      .widest = static_cast<double>(std::ranges::max(hidden)),
      .layers = (1 + critics) * 3 * static_cast<double>(hidden.size())};
}

std::string SacConfig::Text() const {
  return Concat("soft actor-critic, ", twin ? "networks" : "one critic, networks", " of ",
                Join(hidden, "-"));
}

std::vector<std::string> SacConfig::Warnings(int64_t steps, int64_t /*num_envs*/) const {
  std::vector<std::string> warnings = off_policy.Warnings(steps);
  if (actor_rate == 0) warnings.emplace_back("actor_rate is 0: the policy never changes");
  if (tau == 0) warnings.emplace_back("tau is 0: the target critics never change");
  return warnings;
}

NetworkShape SacConfig::Shape(int inputs, int outputs) const {
  return {inputs, hidden, outputs, layer_norm};
}

}  // namespace upswing
