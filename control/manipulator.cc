#include "control/manipulator.h"

#include <cmath>

namespace upswing {

Manipulator::Manipulator(const Plant& plant) {
  ClosedFormBatch batch(1);
  batch.SetPlant(0, plant);
  J1_ = batch.J1[0];
  J2_ = batch.J2[0];
  b_ = batch.b[0];
  G1_ = batch.G1[0];
  G2_ = batch.G2[0];
  d1_ = batch.d1[0];
  d2_ = batch.d2[0];
}

ManipulatorTerms Manipulator::At(const StateVector& x) const {
  const double q1 = x[0], q2 = x[1], w1 = x[2], w2 = x[3];
  const double bc = b_ * std::cos(q2), bs = b_ * std::sin(q2);
  ManipulatorTerms t;
  t.M11 = J1_ + J2_ + 2 * bc;
  t.M12 = J2_ + bc;
  t.M22 = J2_ + kArmature;
  t.h1 = -bs * (2 * w1 + w2) * w2 + G1_ * std::sin(q1) + G2_ * std::sin(q1 + q2) + d1_ * w1;
  t.h2 = bs * w1 * w1 + G2_ * std::sin(q1 + q2) + d2_ * w2;
  t.energy = (t.M11 * w1 * w1 + 2 * t.M12 * w1 * w2 + t.M22 * w2 * w2) / 2 -
             G1_ * (1 + std::cos(q1)) - G2_ * (1 + std::cos(q1 + q2));
  return t;
}

}  // namespace upswing
