#include "rl/ppo/ppo_config.h"

#include <algorithm>

#include "base/error.h"
#include "base/format.h"
#include "base/text.h"

namespace upswing {
namespace {

/// Throws BadInput unless minibatches divide a rollout of `num_envs` environments, and the rollout
/// has at most 10,000,000 steps.
void CheckBatch(int64_t horizon, int64_t batch, int64_t num_envs) {
  constexpr int64_t kMostRollout = 10'000'000;
  const int64_t rollout = horizon * num_envs;
  if (rollout > kMostRollout) {
    throw BadInput(Concat("horizon: expected at most ", kMostRollout / num_envs, " steps of ",
                          Counted(num_envs, "environment"), ", got ", horizon));
  }
  if (rollout % batch == 0) return;
  int64_t below = batch, above = batch;
  while (below > 1 && rollout % below != 0) --below;
  while (above < rollout && rollout % above != 0) ++above;
  const std::string fits = below < batch && above <= rollout && rollout % above == 0
                               ? Concat(below, " or ", above)
                               : Concat(rollout);
  throw BadInput(Concat("batch: expected a size that divides the ", rollout,
                        " steps of a rollout (horizon ", horizon, ", ",
                        Counted(num_envs, "environment"), "), such as ", fits, ", got ", batch));
}

}  // namespace

void PpoConfig::Describe(Options& o) {
  o.Section("network");
  o.Add(&hidden, "hidden", {1, 4096}, "widths of the hidden layers of actor and critic");
  o.AddChoice(&activation, "activation", {"tanh", "relu"},
              "activation function of the hidden units");
  o.Add(&layer_norm, "layer_norm", "apply layer normalisation in each hidden layer");

  o.Section("agent");
  o.AddChoice(&actions, "actions", {"continuous", "levels"},
              "kind of actions; continuous: normally distributed torques; levels: fixed torques");
  o.Add(&levels, "levels", {2, 1001}, "",
        "number of evenly spaced torque levels, with actions = levels");
  o.Add(&gamma, "gamma", kZeroToOne, "", "discount factor per control step");
  o.Add(&lambda, "lambda", kZeroToOne, "", "decay factor of generalised advantage estimation");
  o.Add(&reward_scale, "reward_scale", kPositive, "",
        "factor on the reward that the agent learns from");
  o.Add(&horizon, "horizon", {1, 1000000}, "steps",
        "length of a rollout, which each environment makes between updates");
  o.Add(&epochs, "epochs", {1, 1000}, "", "number of passes over each rollout");
  o.Add(&batch, "batch", {1, 1000000}, "steps", "size of a minibatch; divides horizon times envs");
  o.Add(&clip, "clip", {1e-6, 1}, "", "clip range around 1 of the ratio of new to old probability");
  o.Add(&value_clip, "value_clip", kNotNegative, "",
        "clip range around the old value; 0: no clipping");
  o.Add(&entropy_bonus, "entropy_bonus", {0, 10}, "", "initial weight of the policy's entropy");
  o.Add(&entropy_bonus_end, "entropy_bonus_end", {0, 10}, "",
        "weight of the policy's entropy after learning_rate_steps");
  o.Add(&max_std, "max_std", {0.01, 7}, "",
        "largest standard deviation of continuous actions, in units of their limit");
  o.Add(&initial_std, "initial_std", {0.01, 5}, "",
        "initial standard deviation of continuous actions, in units of their limit");
  o.Add(&normalize, "normalize",
        "normalise observations by their running mean and standard deviation");
  o.Add(&mirror, "mirror", "mirror a random half of each minibatch");
  o.Add(&learning_rate, "learning_rate", {0, 10}, "", "initial learning rate of Adam");
  o.Add(&learning_rate_end, "learning_rate_end", {0, 10}, "", "final learning rate of Adam");
  o.Add(&learning_rate_steps, "learning_rate_steps", {1, 1e12}, "steps",
        "length of the linear decay of the learning rate");
  o.Add(&kl_target, "kl_target", {0, 10}, "nats",
        "target KL divergence of an update, to which the actor's learning rate adapts; 0: off");
  o.Add(&max_gradient_norm, "max_gradient_norm", kPositive, "",
        "largest global norm of the gradient, of actor and critic each, which is clipped to it");
}

void PpoConfig::Check(int64_t num_envs) const {
  CheckBatch(horizon, batch, num_envs);
  const PpoConfig usual;
  if (!discrete() && levels != usual.levels) {
    throw BadInput(Concat("levels: expected none with actions = continuous, got ", levels,
                          "; set actions = levels to use it"));
  }
  if (!discrete() && initial_std > max_std && initial_std != usual.initial_std) {
    throw BadInput(
        Concat("initial_std: expected at most max_std (", max_std, "), got ", initial_std));
  }
  if (discrete() && initial_std != usual.initial_std) {
    throw BadInput(Concat("initial_std: expected none with actions = levels, got ", initial_std));
  }
}

bool PpoConfig::FitToActions(int64_t choices) {
  actions = choices > 0 ? "levels" : "continuous";
  if (choices > 0) levels = choices;
  return true;
}

AgentSize PpoConfig::Size(const EnvSpec& spec) const {
  const int D = spec.obs_size, A = spec.action_size();
  const Network actor(Shape(D, discrete() ? static_cast<int>(levels) : A));
  const Network critic(Shape(D, 1));
  return {.parameters = static_cast<double>(actor.num_parameters() + critic.num_parameters()),
          // Parameters, gradient, Adam's two moments, and transposed weights.
          .arrays = 5,
          .saved_arrays = 3,
          // Observation and successor, action, ln π, reward, V, V', advantage, target, order, ends.
          .transition = 2.0 * D + A + 9,
          .capacity = static_cast<double>(horizon * spec.num_envs),
          .batch = static_cast<double>(batch),
          .widest = static_cast<double>(std::ranges::max(hidden)),
          .layers = 2 * 3 * static_cast<double>(hidden.size()),
          .store = "rollout",
          .store_flag = "--horizon"};
}

std::string PpoConfig::Text() const {
  return Concat("proximal policy optimisation, ",
                discrete() ? Concat(levels, " torques") : "any torque", ", networks of ",
                Join(hidden, "-"));
}

std::vector<std::string> PpoConfig::Warnings(int64_t steps, int64_t num_envs) const {
  std::vector<std::string> warnings;
  if (horizon * num_envs > steps) {
    warnings.push_back(Concat("a rollout has ", FormatCount(horizon * num_envs),
                              " steps and the training only ", FormatCount(steps),
                              ": the agent learns nothing"));
  }
  WarnOfNoRate(learning_rate, learning_rate_end, warnings);
  return warnings;
}

NetworkShape PpoConfig::Shape(int obs_size, int outputs) const {
  return {obs_size, hidden, outputs, layer_norm,
          activation == "tanh" ? Activation::kTanh : Activation::kRelu};
}

}  // namespace upswing
