#pragma once

#include <array>
#include <string>
#include <vector>

#include "base/options.h"
#include "extras/machine/logs/log.h"

/// Cogging of a machine's motors.
namespace upswing::machine {

/// Cogging: the magnets of a motor without gears pull at the teeth of its stator, so a torque acts
/// that depends on the joint's angle. Its harmonics in a turn are multiples of the numbers of slots
/// and of poles (Piccoli and Yim, "Cogging torque ripple minimization via position based
/// characterization", Robotics: Science and Systems 2014). Both joints have the same kind of motor.
struct Cogging {
  /// The harmonics: pole pairs, slots, poles, 2 slots, 2 poles, 3 slots, least common multiple.
  static constexpr int kHarmonics = 7;
  /// Coefficients of a joint: of sines, then of cosines.
  static constexpr int kCoefficients = 2 * kHarmonics;

  double slots = 0, poles = 0;  // of a motor; 0: no cogging
  // The torque on a joint whose encoder shows the angle q is Σ s sin(n q) + c cos(n q) over the
  // harmonics n, N·m. The encoder of such a motor is absolute, because its drive needs it.
  std::array<std::array<double, kCoefficients>, 2> coefficients{};

  /// Declares each setting in `options`: name, range, unit, help.
  void Describe(Options& options);

  bool any() const { return slots > 0 && poles > 0; }
  /// The harmonics n in a turn.
  std::array<double, kHarmonics> Harmonics() const;
};

/// Names of the coefficients' settings, those of joint 1 first.
std::vector<std::string> CoggingCoefficients();

/// Cogging as the equations of motion need it. Without cogging, all torques are 0.
class CoggingTorque {
 public:
  CoggingTorque() = default;
  /// `zero`: the angles (rad) that the encoders show at the joints' angle 0.
  CoggingTorque(const Cogging& cogging, const Joints& zero);

  bool any() const { return any_; }
  void SetZero(const Joints& zero) { zero_ = zero; }
  /// The torques (N·m) at the joints' angles (rad).
  Joints At(const Joints& angle) const;
  /// Their derivatives by the own angle, N·m/rad.
  Joints SlopeAt(const Joints& angle) const;
  /// The derivatives of the torque of a joint (0 or 1) by its coefficients.
  std::array<double, Cogging::kCoefficients> Factors(int joint, double angle) const;

 private:
  bool any_ = false;
  Joints zero_{};  // rad
  std::array<double, Cogging::kHarmonics> harmonics_{};
  std::array<std::array<double, Cogging::kCoefficients>, 2> coefficients_{};
};

}  // namespace upswing::machine
