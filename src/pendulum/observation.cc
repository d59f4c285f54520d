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

ObservationInfo ObservationInfoOf(int64_t memory, bool identified) {
  ObservationInfo observation{
      {"cos q1", "sin q1", "w1", "cos q2", "sin q2", "w2", "energy", "height"},
      {kMaxVelocity1, kMaxVelocity2},
      {},
      {}};
  if (identified) {
    observation.identified = {
        {"J1", "J2", "b", "G1", "G2", "d1", "d2", "delta", "tanh(0.1 / delta)", "identified energy",
         "faster fall", "slower fall", "torque against the falls"},
        kConstantScale};
  }
  if (memory > 0) {
    observation.memory = {
        memory, {"change of w1", "change of w2", "torque"}, kMemoryVelocity, kMemoryTorque};
  }
  return observation;
}

}  // namespace upswing
