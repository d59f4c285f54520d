// The equations of motion. Symbols: see pendulum/equations.h. Of a link: m mass (kg), l length (m),
// c distance from joint to centre of mass (m), I moment of inertia about that centre (kg·m²).
#include "pendulum/equations.h"

#include <cmath>

namespace upswing {

ManipulatorTerms Manipulator::At(const PendulumState& s) const {
  const auto& [q1, q2, w1, w2] = s;
  const double bs = b * std::sin(q2);
  ManipulatorTerms t{Mass(std::cos(q2)), 0, 0, 0};
  t.h1 = -bs * (2 * w1 + w2) * w2 + G1 * std::sin(q1) + G2 * std::sin(q1 + q2) + d1 * w1 +
         DryFriction(f1, w1);
  t.h2 = bs * w1 * w1 + G2 * std::sin(q1 + q2) + d2 * w2 + DryFriction(f2, w2);
  t.energy = (t.M11 * w1 * w1 + 2 * t.M12 * w1 * w2 + t.M22 * w2 * w2) / 2 -
             G1 * (1 + std::cos(q1)) - G2 * (1 + std::cos(q1 + q2));
  return t;
}

std::array<double, 2> Manipulator::Acceleration(const PendulumState& s,
                                                const std::array<double, 2>& torque) const {
  const ManipulatorTerms t = At(s);
  const double r1 = torque[0] - t.h1, r2 = torque[1] - t.h2;
  return {(t.M22 * r1 - t.M12 * r2) / t.det(), (t.M11 * r2 - t.M12 * r1) / t.det()};
}

Manipulator ManipulatorOf(const Plant& plant) {
  const auto links = LinksOf(plant);
  const auto& [m1, l1, c1, I1] = links[0];
  const auto& [m2, l2, c2, I2] = links[1];
  const double g = plant.gravity;
  Manipulator m;
  m.J1 = I1 + m1 * c1 * c1 + m2 * l1 * l1 + plant.armature;
  m.J2 = I2 + m2 * c2 * c2;
  m.b = m2 * l1 * c2;
  m.a = plant.armature;
  m.G1 = (m1 * c1 + m2 * l1) * g;
  m.G2 = m2 * c2 * g;
  m.d1 = plant.damping1;
  m.d2 = plant.damping2;
  m.f1 = plant.coulomb1;
  m.f2 = plant.coulomb2;
  m.AddRotors(plant.rotor_inertia, plant.gear_ratio);
  return m;
}

}  // namespace upswing
