#include "control/swing_up.h"

namespace upswing {

void EnergyShapingConfig::Describe(Options& o) {
  // Of 1,900 tried at random these brought up most starts with the standard motor.
  o.Section("energy");
  o.Add(&kE, "energy_ke", kNotNegative, "1/(J²·s)", "weight of the energy's square in V");
  o.Add(&kD, "energy_kd", kPositive, "s", "weight of the square of w1 in V");
  o.Add(&kP, "energy_kp", kNotNegative, "1/s", "weight of the square of q1 from upright in V");
}

void PartialFeedbackConfig::Describe(Options& o) {
  // The same of 800.
  o.Section("pfl");
  o.Add(&kP, "pfl_kp", kNotNegative, "1/s²", "gain of the angle of link 1 from upright");
  o.Add(&kD, "pfl_kd", kNotNegative, "1/s", "gain of its velocity");
  o.Add(&kE, "pfl_ke", kNotNegative, "1/(J·s)", "gain of the energy that is missing");
}

double EnergyShapingTorque(const EnergyShapingConfig& config, const Manipulator& plant,
                           const StateVector& deviation) {
  const ManipulatorTerms t = plant.At(StateOf(FromUpright(deviation)));
  const double det = t.M11 * t.M22 - t.M12 * t.M12;
  const double F = t.M12 * t.h2 - t.M22 * t.h1;  // det q̈1 = M22 u + F
  const double w1 = deviation[2];
  return -(config.kD * F + det * (w1 + config.kP * deviation[0])) /
         (det * config.kE * t.energy + config.kD * t.M22);
}

double PartialFeedbackTorque(const PartialFeedbackConfig& config, const Manipulator& plant,
                             const StateVector& deviation) {
  const ManipulatorTerms t = plant.At(StateOf(FromUpright(deviation)));
  const double w1 = deviation[2];
  const double acceleration =
      -config.kP * deviation[0] - config.kD * w1 - config.kE * t.energy * w1;
  return (t.M11 - t.M12 * t.M12 / t.M22) * acceleration + t.h1 - t.M12 / t.M22 * t.h2;
}

}  // namespace upswing
