#include <array>
#include <nlohmann/json.hpp>
#include <numbers>

#include "agents/config.h"
#include "base/rng.h"
#include "base/safetensors.h"
#include "extras/deploy/export.h"
#include "nn/gaussian.h"
#include "nn/network_policy.h"
#include "pendulum/disturbance.h"
#include "pendulum/double_pendulum.h"
#include "pendulum/pendulum_env.h"
#include "pendulum/randomization.h"
#include "rl/softmax.h"

namespace upswing {
namespace {

using nlohmann::ordered_json;

constexpr double kPi = std::numbers::pi;
constexpr int kStatesOfAKind = 16;

ordered_json PlantJson(const Plant& plant) {
  ordered_json j;
  for (const auto& [name, value] : PlantValues(plant)) j[name] = value;
  return j;
}

ordered_json StateJson(const PendulumState& s) { return {s.q1, s.q2, s.w1, s.w2}; }

/// The nominal plant, or a plant with each parameter within 50% of it.
Plant DrawPlant(bool nominal, Rng& rng) {
  Randomization half;
  half.plant.fill(0.5);
  return nominal ? Plant() : half.Draw(Plant(), rng);
}

PendulumState NearHanging(int /*i*/, Rng& rng) {
  return {0.1 * rng.Normal(), 0.1 * rng.Normal(), 0.1 * rng.Normal(), 0.1 * rng.Normal()};
}

PendulumState NearUpright(int i, Rng& rng) {
  PendulumState s = NearHanging(i, rng);
  s.q1 += rng.Below(2) == 0 ? kPi : -kPi;
  return s;
}

/// One link half a degree inside or outside the 30° limit of inverted, to the left or right; the
/// other link is upright.
PendulumState AtTheEdge(int i, Rng& rng) {
  const double degrees = (i % 2 == 0 ? 29.5 : 30.5) * (i / 2 % 2 == 0 ? 1 : -1);
  const double lean = degrees * kPi / 180;
  const bool first = i / 4 % 2 == 0;
  return {first ? kPi + lean : kPi, first ? -lean : lean, rng.Normal(), rng.Normal()};
}

/// Any angles, more than a turn included, and velocities beyond the observation's divisors.
PendulumState Anywhere(int /*i*/, Rng& rng) {
  return {rng.Uniform(-3 * kPi, 3 * kPi), rng.Uniform(-3 * kPi, 3 * kPi), rng.Uniform(-20, 20),
          rng.Uniform(-20, 20)};
}

ordered_json CaseJson(const Plant& plant, const PendulumState& s, double torque) {
  std::array<double, kRewardTerms> terms = RewardTerms(plant, s, torque);
  for (double& term : terms) term += 0.0;  // turns -0 into 0
  return {{"plant", PlantJson(plant)},
          {"state", StateJson(s)},
          {"torque", torque},
          {"observation", Observe(plant, s)},
          {"energy", Energy(plant, s)},
          {"energy_target", EnergyTarget(plant)},
          {"normalized_energy", NormalizedEnergy(plant, s)},
          {"tip_height", TipHeight(plant, s)},
          {"inverted", Inverted(s)},
          {"reward_terms", terms}};
}

ordered_json Cases() {
  ordered_json cases;
  Rng rng(0, "test vectors");
  for (const auto draw : {NearHanging, NearUpright, AtTheEdge, Anywhere}) {
    for (int i = 0; i < kStatesOfAKind; ++i) {
      const Plant plant = DrawPlant(i % 4 == 0, rng);
      const PendulumState s = draw(i, rng);
      cases.push_back(CaseJson(plant, s, rng.Uniform(-plant.torque_limit, plant.torque_limit)));
    }
  }
  return cases;
}

ordered_json Capsules() {
  ordered_json capsules;
  Rng rng(0, "test vectors: capsules");
  for (int i = 0; i < 8; ++i) {
    const Plant plant = DrawPlant(i == 0, rng);
    const CapsuleInertia inertia(plant.mass1, kCapsuleRadius, plant.length1);
    capsules.push_back({{"mass", plant.mass1},
                        {"radius", kCapsuleRadius},
                        {"length", plant.length1},
                        {"across", inertia.across},
                        {"along", inertia.along}});
  }
  return capsules;
}

ordered_json Models() {
  ordered_json models;
  Rng rng(0, "test vectors: models");
  for (const bool nominal : {true, false}) {
    const Plant plant = DrawPlant(nominal, rng);
    models.push_back({{"plant", PlantJson(plant)}, {"mjcf", Mjcf(plant)}});
  }
  return models;
}

/// Random torques, N·m, one for each control step.
std::vector<double> DrawTorques(int steps, const std::string& stream) {
  Rng rng(0, stream);
  std::vector<double> torques(static_cast<size_t>(steps));
  for (double& torque : torques) torque = 1.25 * (static_cast<double>(rng.Below(9)) - 4);
  return torques;
}

/// Observations from a start on: steps + 1 of them.
ordered_json Observations(int memory, const PendulumState& start,
                          const std::vector<double>& torques) {
  PendulumEnvConfig config;
  config.memory = memory;
  PendulumEnv env(config);
  env.SetState(0, start);
  StepResult result = env.MakeResult();
  ordered_json observations;
  const auto add = [&] {
    const auto row = env.obs().row(0);
    observations.push_back(std::vector<float>(row.begin(), row.end()));
  };
  add();
  for (const double torque : torques) {
    env.Step({&torque, 1}, result);
    add();
  }
  return observations;
}

ordered_json ObservationMemory() {
  const PendulumState start{0.3, -0.2, 1.5, -0.7};
  const std::vector<double> torques = DrawTorques(8, "test vectors: memory");
  ordered_json j{{"plant", PlantJson(Plant())}, {"start", StateJson(start)}, {"torques", torques}};
  j["observations"] = Observations(0, start, torques);
  for (const int memory : {2, 4}) {
    j["with_memory"].push_back(
        {{"memory", memory}, {"observations", Observations(memory, start, torques)}});
  }
  return j;
}

ordered_json Delays() {
  ordered_json delays;
  const std::vector<double> chosen = DrawTorques(12, "test vectors: delay");
  for (const double delay : {0.0, 0.02, 0.05, 0.1}) {
    Disturbance disturbance;
    disturbance.delay = delay;
    Disturber disturber({disturbance}, 1, disturbance, 0, "");
    disturber.Begin(0, {});
    std::vector<double> applied;
    for (size_t i = 0; i < chosen.size(); ++i) {
      const auto step = static_cast<int64_t>(i);
      applied.push_back(disturber.Apply({&chosen[i], 1}, {&step, 1}).front());
    }
    delays.push_back({{"delay", delay},
                      {"steps", disturbance.delay_steps()},
                      {"chosen", chosen},
                      {"applied", applied}});
  }
  return delays;
}

constexpr int kSize = kObservationSize;
constexpr int kActorCases = 12;
constexpr int kPieces = 10;  // number of pieces of the torque range

/// Parameters of an untrained network. The output layer's are larger than usual, so that not all
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

/// A policy of this kind with a critic of `critic_inputs` numbers; 0: no critic.
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

/// The bytes of a policy's file, each as two hexadecimal digits.
std::string FileAsHex(const NetworkPolicy& policy) {
  std::string hex;
  for (const std::byte byte : WriteSafetensors(policy.ToTensors()).Joined()) {
    hex += HexDigits(std::to_integer<uint64_t>(byte), 2);
  }
  return hex;
}

/// The action probabilities. A Gaussian has one for each of kPieces equal pieces of the torque
/// range; the end pieces include the clipped tails. A categorical policy has one for each torque.
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

ordered_json ActorCase(const NetworkPolicy& policy, std::vector<float>& obs) {
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

/// Untrained actor policies with each kind of output, as files, and their results for observations.
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
    for (int i = 0; i < kActorCases; ++i) {
      std::vector<float> obs(kSize);
      for (float& x : obs) x = static_cast<float>(rng.Uniform(-2, 2));
      cases.push_back(ActorCase(policy, obs));
    }
    actors.push_back({{"file", FileAsHex(policy)}, {"cases", cases}});
  }
  return actors;
}

}  // namespace

std::string TestVectorsJson() {
  ordered_json j;
  j["upswing_version"] = UPSWING_VERSION;
  j["constants"] = {
      {"control_period", kControlPeriod},   {"physics_timestep", kPhysicsTimestep},
      {"physics_steps", kPhysicsSteps},     {"armature", kArmature},
      {"capsule_radius", kCapsuleRadius},   {"max_velocity", {kMaxVelocity1, kMaxVelocity2}},
      {"memory_velocity", kMemoryVelocity}, {"memory_torque", kMemoryTorque},
      {"reward_terms", kRewardTermNames}};
  j["cases"] = Cases();
  j["capsules"] = Capsules();
  j["models"] = Models();
  j["observation_memory"] = ObservationMemory();
  j["delays"] = Delays();
  j["actors"] = ActorVectors();
  return j.dump(1) + '\n';
}

}  // namespace upswing
