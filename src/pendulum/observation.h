#pragma once

#include <cstdint>
#include <optional>
#include <span>

#include "base/archive.h"
#include "base/policy_info.h"
#include "pendulum/goal.h"
#include "pendulum/identification.h"
#include "pendulum/sensors.h"

/// Observations of the double pendulum: of a state, with an identified plant and with a memory.
namespace upswing {

/// Sign of each observation under the mirror symmetry, which negates angles, velocities and torque.
/// All numbers of the memory change sign.
inline constexpr std::array<float, kObservationSize> kMirrorSigns{1, -1, -1, 1, -1, -1, 1, 1};

/// Numbers that an observation may hold for each past control step, latest first: [Δw1, Δw2, tau].
/// Δw is the change of the velocities over kMemoryVelocity, tau the chosen torque over
/// kMemoryTorque, both in units of a Scale. The plant's response reveals what the state lacks:
/// masses, lengths, and torques that are still delayed.
inline constexpr int kMemorySize = 3;
/// Numbers that a goal adds to an observation, before the memory: for each link, 1 if it is to
/// point up and -1 if down.
inline constexpr int kGoalSize = 2;
constexpr std::array<float, kGoalSize> GoalInputs(const Pose& goal) {
  return {goal.up1 ? 1.0F : -1.0F, goal.up2 ? 1.0F : -1.0F};
}
/// Typical change of a velocity by the motor in one control period (rad/s), and the standard torque
/// limit (N·m).
inline constexpr double kMemoryVelocity = 1.0, kMemoryTorque = 5.0;

/// Writes the memory of an observation, its last 3 × `steps` numbers; the first numbers must be
/// filled already. `before` is the previous observation, at which the torque was chosen. It counts
/// in units of Scale::torque: N·m for the built-in plant.
void Remember(std::span<const float> before, double torque, int steps, std::span<float> obs);

/// Writes the inputs of a goal into an observation with `memory` past steps.
void WriteGoal(const Pose& goal, int memory, std::span<float> obs);

/// Description, for a policy file, of observations in units of `scale` with `memory` past steps; if
/// `identified`, an identified plant; if `any_pose`, a goal.
ObservationInfo ObservationInfoOf(const Scale& scale, int64_t memory, bool identified = false,
                                  bool any_pose = false);

/// The units in a policy's metadata, and their counterpart.
inline Scale ScaleIn(const PolicyInfo& info) { return {info.time_scale, info.torque_scale}; }
inline void SetScale(const Scale& scale, PolicyInfo& info) {
  info.time_scale = scale.time;
  info.torque_scale = scale.torque;
}

/// Builds the observations (D) of N environments from what their sensors measure:
///   8             of the measured state, see Observe
///   13            of the identified plant, if there is one
///   2             of the goal, if it can be any pose; WriteGoal writes them
///   3 × `memory`  of the past control steps
class ObservationBuilder {
 public:
  /// `identified_from`: the nominal plant where identification starts; none: no identification.
  ObservationBuilder(int num_envs, const Scale& scale, double control_period, int memory,
                     const std::optional<Plant>& identified_from);

  /// Writes the first observation of an episode. `plant` gives its energy and height. Its memory is
  /// zero.
  void Begin(int env, const Plant& plant, const PendulumState& measured, std::span<float> obs);
  /// Writes the observation after a control period. `before` is the observation at which the torque
  /// `chosen` (N·m) was chosen.
  void Next(int env, const Plant& plant, const Measurement& measured, std::span<const float> before,
            double chosen, std::span<float> obs);
  /// Does the same where the first kObservationSize numbers are written already.
  void Complete(int env, const Measurement& measured, std::span<const float> before, double chosen,
                std::span<float> obs);

  /// Saves or loads the identified plants.
  void State(const Archive& archive);

 private:
  Scale scale_;
  int memory_;
  std::optional<Identifier> identifier_;
};

}  // namespace upswing
