#pragma once

#include <array>
#include <span>
#include <vector>

#include "core/archive.h"
#include "sim/closed_form.h"
#include "sim/double_pendulum.h"
#include "sim/upright_modes.h"

/// Identification of an unknown plant while it moves, from measured angles and velocities and the
/// torque of its motor: a Kalman filter of its constants (Ljung, "System Identification", 1999,
/// section 11.2), whose prediction is the physics itself.
namespace upswing {

/// The constants that are identified: J1, J2, b, G1, G2, d1, d2 of Manipulator. The others,
/// armature and dry friction, count as known. The equations of motion are linear in all.
inline constexpr int kConstants = 7;
inline constexpr std::array<double Manipulator::*, kConstants> kIdentified{
    &Manipulator::J1, &Manipulator::J2, &Manipulator::b, &Manipulator::G1,
    &Manipulator::G2, &Manipulator::d1, &Manipulator::d2};

/// What identification adds to an observation, 13 numbers:
///   7  each constant's deviation from the nominal plant's as a share of it, over kConstantScale;
///      one that is nominally 0, as without damping, stays so
///   2  δ, within ±1, and tanh(0.1 / δ)
///   1  energy, 0 hanging at rest and 1 upright
///   2  ζ / (1 + |ζ|) of the faster and of the slower mode, see Falling
///   1  Falling::torque, within ±1
static_assert(kIdentifiedSize == kConstants + 6);
extern const std::array<float, kIdentifiedSize> kIdentifiedMirrorSigns;

/// The estimates of N environments.
class Identifier {
 public:
  /// Begins with the nominal plant, whose masses, lengths, dampings and gravity may each be off by
  /// a standard deviation of 15%.
  Identifier(const Plant& nominal, int num_envs);

  /// Begins an episode of an environment in a measured state: nothing is known of its plant.
  void Begin(int env, const PendulumState& measured);
  /// Learns from a control period: the torque (N·m) that acted, and the state measured at its end.
  /// `noise` is the standard deviation (rad/s) of the sensors' own error in the measured change of
  /// velocities.
  void Update(int env, double torque, const PendulumState& measured, double noise = 0);

  /// The plant as it is estimated.
  Manipulator estimate(int env) const;
  /// What is added to the observation of a state (kIdentifiedSize).
  void Observe(int env, const PendulumState& s, std::span<float> numbers) const;

  void State(const Archive& archive);

 private:
  static constexpr int kCovariance = kConstants * (kConstants + 1) / 2;

  /// Keeps what was measured, and returns what was measured before.
  PendulumState Replace(int env, const PendulumState& measured);
  /// Where a plant moves within a control period.
  PendulumState Predict(const Manipulator& plant, double torque, const PendulumState& from);

  Plant plant_;  // the nominal one
  Manipulator nominal_;
  std::array<double, kCovariance> prior_;  // of the relative constants
  std::vector<double> relative_;           // (N × kConstants)
  std::vector<double> covariance_;         // (N × kCovariance) upper triangles
  std::vector<double> last_;               // (N × 4) states measured last, as in PendulumState
  ClosedFormBatch prediction_;             // of one plant
};

}  // namespace upswing
