#include "control/swing_up.h"

namespace upswing {

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
