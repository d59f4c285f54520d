#include "pendulum/observation.h"

#include <algorithm>

namespace upswing {

void Remember(std::span<const float> before, double torque, int steps, std::span<float> obs) {
  const size_t first = obs.size() - static_cast<size_t>(steps) * kMemorySize;
  const auto entry = obs.subspan(first, kMemorySize);
  entry[0] = (obs[2] - before[2]) * static_cast<float>(kMaxVelocity1 / kMemoryVelocity);
  entry[1] = (obs[5] - before[5]) * static_cast<float>(kMaxVelocity2 / kMemoryVelocity);
  entry[2] = static_cast<float>(torque / kMemoryTorque);
  const auto older = before.subspan(first).first(obs.size() - first - kMemorySize);
  std::ranges::copy(older, obs.subspan(first + kMemorySize).begin());
}

void WriteGoal(const Pose& goal, int memory, std::span<float> obs) {
  const auto inputs = obs.last(static_cast<size_t>(kGoalSize + memory * kMemorySize));
  std::ranges::copy(GoalInputs(goal), inputs.begin());
}

ObservationBuilder::ObservationBuilder(int num_envs, const Scale& scale, double control_period,
                                       int memory, const std::optional<Plant>& identified_from)
    : scale_(scale), memory_(memory) {
  if (identified_from) identifier_.emplace(*identified_from, control_period, num_envs);
}

void ObservationBuilder::Begin(int env, const Plant& plant, const PendulumState& measured,
                               std::span<float> obs) {
  std::ranges::copy(Observe(plant, measured, scale_), obs.begin());
  std::ranges::fill(obs.last(static_cast<size_t>(memory_ * kMemorySize)), 0.0F);
  if (!identifier_) return;
  identifier_->Begin(env, measured);
  identifier_->Observe(env, measured, obs.subspan(kObservationSize, kIdentifiedSize));
}

void ObservationBuilder::Next(int env, const Plant& plant, const Measurement& measured,
                              std::span<const float> before, double chosen, std::span<float> obs) {
  std::ranges::copy(Observe(plant, measured.state, scale_), obs.begin());
  Complete(env, measured, before, chosen, obs);
}

void ObservationBuilder::Complete(int env, const Measurement& measured,
                                  std::span<const float> before, double chosen,
                                  std::span<float> obs) {
  if (identifier_) {
    identifier_->Update(env, measured.torque, measured.state, measured.velocity_noise);
    identifier_->Observe(env, measured.state, obs.subspan(kObservationSize, kIdentifiedSize));
  }
  if (memory_ > 0) Remember(before, chosen / scale_.torque, memory_, obs);
}

void ObservationBuilder::State(const Archive& archive) {
  if (identifier_) identifier_->State(archive.In("identification"));
}

ObservationInfo ObservationInfoOf(const Scale& scale, int64_t memory, bool identified,
                                  bool any_pose) {
  ObservationInfo observation{
      {"cos q1", "sin q1", "w1", "cos q2", "sin q2", "w2", "energy", "height"},
      {kMaxVelocity1 * scale.velocity(), kMaxVelocity2 * scale.velocity()}};
  if (identified) {
    observation.identified = {
        {"J1", "J2", "b", "G1", "G2", "d1", "d2", "delta", "tanh(0.1 / delta)", "identified energy",
         "faster fall", "slower fall", "torque against the falls"},
        kConstantScale};
  }
  if (any_pose) observation.goal = {"goal of link 1", "goal of link 2"};
  if (memory > 0) {
    observation.memory = {memory,
                          {"change of w1", "change of w2", "torque"},
                          kMemoryVelocity * scale.velocity(),
                          kMemoryTorque * scale.torque};
  }
  return observation;
}

}  // namespace upswing
