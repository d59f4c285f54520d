#pragma once

#include <cstdint>
#include <span>

#include "base/policy_info.h"
#include "pendulum/identification.h"
#include "pendulum/task.h"

/// Observations of the double pendulum with a memory and with an identified plant.
namespace upswing {

/// Numbers that an observation may hold for each past control step, latest first: [Δw1, Δw2, tau].
/// Δw is the change of the velocities over kMemoryVelocity, tau the chosen torque over
/// kMemoryTorque. The plant's response reveals what the state lacks: masses, lengths, and torques
/// that are still delayed.
inline constexpr int kMemorySize = 3;
/// Number of past control steps in an observation of `obs_size` numbers.
constexpr int MemorySteps(int obs_size, bool identified = false) {
  return (obs_size - kObservationSize - (identified ? kIdentifiedSize : 0)) / kMemorySize;
}
/// Typical change of a velocity by the motor in one control period (rad/s), and the standard torque
/// limit (N·m).
inline constexpr double kMemoryVelocity = 1.0, kMemoryTorque = 5.0;

/// Writes the memory of an observation, its last 3 × `steps` numbers; the first numbers must be
/// filled already. `before` is the previous observation, at which the torque (N·m) was chosen.
void Remember(std::span<const float> before, double torque, int steps, std::span<float> obs);

/// Description, for a policy file, of observations with `memory` past steps and, if `identified`,
/// an identified plant.
ObservationInfo ObservationInfoOf(int64_t memory, bool identified = false);

}  // namespace upswing
