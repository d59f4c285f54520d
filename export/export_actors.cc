#include "export/export_actors.h"

#include <array>

#include "core/rng.h"
#include "core/safetensors.h"
#include "core/text.h"
#include "nn/gaussian.h"
#include "nn/network_policy.h"
#include "rl/softmax.h"
#include "setup/config.h"
#include "setup/loaded_policy.h"

namespace upswing {
namespace {

using nlohmann::ordered_json;

constexpr int kSize = kObservationSize;
constexpr int kCases = 12;
constexpr int kPieces = 10;  // of the range of torques

/// Parameters of an untrained network. Those of its output are larger than usual, so that not all
/// actions are near 0.
AlignedVector<float> DrawParameters(const NetworkShape& shape, Rng& rng) {
  const Network network(shape);
  AlignedVector<float> parameters(network.num_parameters());
  network.Initialize(rng, parameters);
  for (const ParameterBlock& block : network.blocks()) {
    if (!block.name.starts_with("output")) continue;
    for (size_t i = 0; i < block.size(); ++i) parameters[block.offset + i] *= 4;
  }
  return parameters;
}

/// A policy of this kind whose critic takes `critic_inputs` numbers; 0: there is none.
NetworkPolicy DrawPolicy(ActionRule rule, const NetworkShape& actor, int critic_inputs, Rng& rng) {
  NetworkPolicyParts parts{rule, actor};
  parts.action_limit = {Plant().torque_limit};
  if (rule == ActionRule::kCategorical) parts.torques = {-5, -2.5, 0, 2.5, 5};
  parts.parameters = DrawParameters(actor, rng);
  if (critic_inputs > 0) {
    parts.critic = {critic_inputs, {10}, 1, !actor.layer_norm, actor.activation};
    parts.critic_parameters = DrawParameters(parts.critic, rng);
  }
  return {std::move(parts), InfoOf(Config())};
}

/// The bytes of a policy's file, two hexadecimal digits each.
std::string FileAsHex(const NetworkPolicy& policy) {
  std::string hex;
  for (const std::byte byte : WriteSafetensors(policy.ToTensors()).Joined()) {
    for (const int shift : {4, 0}) {
      hex += "0123456789abcdef"[(std::to_integer<int>(byte) >> shift) & 15];
    }
  }
  return hex;
}

/// A Gaussian's probabilities of equal pieces of the range of torques, the ends with what is cut
/// off there; a categorical's of its torques.
std::vector<double> Probabilities(ActionRule rule, std::span<const float> outputs) {
  if (rule == ActionRule::kCategorical) {
    const std::vector<double> logits(outputs.begin(), outputs.end());
    std::vector<double> probabilities(logits.size());
    Softmax<double>(logits, probabilities);
    return probabilities;
  }
  std::vector<double> all(kPieces + 2);
  ActionProbabilities(Gaussian<double>::From(outputs[0], outputs[1]),
                      rule == ActionRule::kSquashedGaussian, all);
  std::vector<double> probabilities(all.begin() + 1, all.end() - 1);
  probabilities.front() += all.front();
  probabilities.back() += all.back();
  return probabilities;
}

ordered_json CaseJson(const NetworkPolicy& policy, std::vector<float>& obs) {
  const auto memory = policy.Start(1);
  const Matrix<const float> row(obs.data(), 1, kSize);
  std::vector<float> outputs(static_cast<size_t>(policy.num_outputs()));
  double torque = 0, low = 0, high = 0;
  policy.Outputs(row, {outputs.data(), 1, policy.num_outputs()}, *memory);
  policy.Act(row, {&torque, 1, 1}, *memory);
  policy.Spread(row, {&low, 1, 1}, {&high, 1, 1}, *memory);
  ordered_json j{
      {"observation", obs}, {"outputs", outputs},
      {"torque", torque},   {"low", low},
      {"high", high},       {"probabilities", Probabilities(policy.parts().rule, outputs)},
      {"value", nullptr}};
  if (policy.num_values() == 0) return j;
  float value = 0;
  policy.Values(row, {&value, 1, 1}, *memory);
  j["value"] = value;
  return j;
}

}  // namespace

ordered_json ActorVectors() {
  struct Kind {
    ActionRule rule;
    NetworkShape actor;
    int critic_inputs;
  };
  const std::array<Kind, 4> kinds{
      {{ActionRule::kSquashedGaussian, {kSize, {12, 10}, 2, true, Activation::kRelu}, kSize + 1},
       {ActionRule::kSquashedGaussian, {kSize, {8}, 2, false, Activation::kTanh}, 0},
       {ActionRule::kClippedGaussian, {kSize, {10, 8}, 2, false, Activation::kTanh}, kSize},
       {ActionRule::kCategorical, {kSize, {12}, 5, true, Activation::kRelu}, kSize}}};
  ordered_json actors;
  Rng rng(0, "test vectors: actors");
  for (const Kind& kind : kinds) {
    const NetworkPolicy policy = DrawPolicy(kind.rule, kind.actor, kind.critic_inputs, rng);
    ordered_json cases;
    for (int i = 0; i < kCases; ++i) {
      std::vector<float> obs(kSize);
      for (float& x : obs) x = static_cast<float>(rng.Uniform(-2, 2));
      cases.push_back(CaseJson(policy, obs));
    }
    actors.push_back({{"file", FileAsHex(policy)}, {"cases", cases}});
  }
  return actors;
}

}  // namespace upswing
