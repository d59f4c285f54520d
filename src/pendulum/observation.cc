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

ObservationBuilder::ObservationBuilder(int num_envs, int memory,
                                       const std::optional<Plant>& identified_from, bool any_pose)
    : memory_(memory), goals_(any_pose ? static_cast<size_t>(num_envs) : 0) {
  if (identified_from) identifier_.emplace(*identified_from, num_envs);
}

void ObservationBuilder::SetGoal(int env, const Pose& goal) {
  goals_[static_cast<size_t>(env)] = std::ranges::find(kPoses, goal) - kPoses.begin();
}

std::optional<Pose> ObservationBuilder::goal(int env) const {
  if (goals_.empty()) return std::nullopt;
  return kPoses[static_cast<size_t>(goals_[static_cast<size_t>(env)])];
}

void ObservationBuilder::WriteGoal(int env, std::span<float> obs) const {
  const std::optional<Pose> pose = goal(env);
  if (!pose) return;
  const auto at = obs.last(static_cast<size_t>(kGoalSize + memory_ * kMemorySize));
  std::ranges::copy(GoalInputs(*pose), at.begin());
}

void ObservationBuilder::Begin(int env, const Plant& plant, const PendulumState& measured,
                               std::span<float> obs) {
  std::ranges::fill(obs, 0.0F);
  std::ranges::copy(Observe(plant, measured), obs.begin());
  WriteGoal(env, obs);
  if (!identifier_) return;
  identifier_->Begin(env, measured);
  identifier_->Observe(env, measured, obs.subspan(kObservationSize, kIdentifiedSize));
}

void ObservationBuilder::Next(int env, const Plant& plant, const Measurement& measured,
                              std::span<const float> before, double chosen, std::span<float> obs) {
  std::ranges::copy(Observe(plant, measured.state), obs.begin());
  Complete(env, measured, before, chosen, obs);
}

void ObservationBuilder::Complete(int env, const Measurement& measured,
                                  std::span<const float> before, double chosen,
                                  std::span<float> obs) {
  if (identifier_) {
    identifier_->Update(env, measured.torque, measured.state, measured.velocity_noise);
    identifier_->Observe(env, measured.state, obs.subspan(kObservationSize, kIdentifiedSize));
  }
  WriteGoal(env, obs);
  if (memory_ > 0) Remember(before, chosen, memory_, obs);
}

void ObservationBuilder::State(const Archive& archive) {
  if (identifier_) identifier_->State(archive.In("identification"));
  if (!goals_.empty()) archive.Array("goals", std::span(goals_), {0, kPoses.size() - 1});
}

ObservationInfo ObservationInfoOf(int64_t memory, bool identified, bool any_pose) {
  ObservationInfo observation{
      {"cos q1", "sin q1", "w1", "cos q2", "sin q2", "w2", "energy", "height"},
      {kMaxVelocity1, kMaxVelocity2}};
  if (identified) {
    observation.identified = {
        {"J1", "J2", "b", "G1", "G2", "d1", "d2", "delta", "tanh(0.1 / delta)", "identified energy",
         "faster fall", "slower fall", "torque against the falls"},
        kConstantScale};
  }
  if (any_pose) observation.goal = {"goal of link 1", "goal of link 2"};
  if (memory > 0) {
    observation.memory = {
        memory, {"change of w1", "change of w2", "torque"}, kMemoryVelocity, kMemoryTorque};
  }
  return observation;
}

}  // namespace upswing
