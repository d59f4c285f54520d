#pragma once

#include <array>
#include <span>
#include <vector>

#include "base/archive.h"
#include "pendulum/closed_form.h"
#include "pendulum/plant.h"
#include "pendulum/upright_modes.h"

/// Identification of an unknown plant while it moves, from measured angles and velocities and the
/// motor's torque. A Kalman filter estimates its constants (Ljung, "System Identification", 1999,
/// section 11.2); the prediction is one control period of the physics.
namespace upswing {

/// Number of identified constants: J1, J2, b, G1, G2, d1, d2 of Manipulator. Armature and dry
/// friction are taken as known. The equations of motion are linear in all constants.
inline constexpr int kConstants = 7;
inline constexpr std::array<double Manipulator::*, kConstants> kIdentified{
    &Manipulator::J1, &Manipulator::J2, &Manipulator::b, &Manipulator::G1,
    &Manipulator::G2, &Manipulator::d1, &Manipulator::d2};

/// The 13 numbers that identification adds to an observation:
///   7  each constant's relative deviation from the nominal plant, over kConstantScale; a constant
///   that is nominally 0, such as no damping, stays at 0
///   2  δ, within ±1, and tanh(0.1 / δ)
///   1  energy, 0 hanging at rest and 1 upright
///   2  ζ / (1 + |ζ|) of the faster and of the slower mode, see Falling
///   1  Falling::torque, within ±1
inline constexpr int kIdentifiedSize = kConstants + 6;
inline constexpr double kConstantScale = 0.5;  // divisor of the constants' deviations
extern const std::array<float, kIdentifiedSize> kIdentifiedMirrorSigns;

/// The estimated plants of N environments.
class Identifier {
 public:
  /// Begins with the nominal plant. Its masses, lengths, dampings, gravity, own centres of mass and
  /// own inertias each have a standard deviation of 15%. An update comes after each control period
  /// (s).
  Identifier(const Plant& nominal, double control_period, int num_envs);

  /// Begins an episode of an environment in a measured state, with the nominal plant as the
  /// estimate.
  void Begin(int env, const PendulumState& measured);
  /// Updates the estimate after a control period, from the torque (N·m) that acted and the state
  /// measured at its end. `noise` is the standard deviation (rad/s) of the sensors' own error in
  /// the measured change of velocities.
  void Update(int env, double torque, const PendulumState& measured, double noise = 0);

  /// The estimated plant.
  Manipulator estimate(int env) const;
  /// Writes the numbers that identification adds to the observation of a state (kIdentifiedSize).
  void Observe(int env, const PendulumState& s, std::span<float> numbers) const;

  /// What the filter starts from, for a copy of it in another language.
  int physics_steps() const { return physics_steps_; }  // in a control period
  double noise() const { return noise_; }               // of a measured change of velocity, rad/s
  std::span<const double> prior() const { return prior_; }  // covariance; upper triangle by rows

  void State(const Archive& archive);

 private:
  static constexpr int kCovariance = kConstants * (kConstants + 1) / 2;

  /// Stores the measured state and returns the one measured before.
  PendulumState Replace(int env, const PendulumState& measured);
  /// The state of a plant one control period later.
  PendulumState Predict(const Manipulator& plant, double torque, const PendulumState& from);

  Plant plant_;        // nominal
  double period_;      // s, of control
  int physics_steps_;  // in a control period
  double noise_;       // of a measured change of velocity, rad/s
  Manipulator nominal_;
  std::array<double, kCovariance> prior_;  // covariance of the relative constants at the start
  std::vector<double> relative_;           // (N × kConstants)
  std::vector<double> covariance_;         // (N × kCovariance) upper triangles
  std::vector<double> last_;               // (N × 4) last measured states q1, q2, w1, w2
  ClosedFormBatch prediction_;             // scratch for one plant
};

}  // namespace upswing
