// The constants of a plant and the equations of motion of doubles. Of a link: m mass (kg), l length
// (m), c distance from joint to centre of mass (m), I moment of inertia about that centre (kg·m²).
#include "pendulum/equations.h"

#include <cmath>

#include "pendulum/dynamics.h"

namespace upswing {

MassMatrix Manipulator::Mass(double cos_q2) const { return dynamics::MassAt(*this, cos_q2); }

ManipulatorTerms Manipulator::At(const PendulumState& s) const {
  const auto& [q1, q2, w1, w2] = s;
  const auto angles = dynamics::AnglesOf<double>({q1, q2});
  const auto r = dynamics::NetTorque<true>(*this, angles, {w1, w2}, {0, 0});
  ManipulatorTerms t{Mass(angles.c2), -r.one, -r.two, 0};
  t.energy = (t.M11 * w1 * w1 + 2 * t.M12 * w1 * w2 + t.M22 * w2 * w2) / 2 - G1 * (1 + angles.c1) -
             G2 * (1 + angles.c12());
  return t;
}

std::array<double, 2> Manipulator::Acceleration(const PendulumState& s,
                                                const std::array<double, 2>& torque) const {
  const auto angles = dynamics::AnglesOf<double>({s.q1, s.q2});
  const auto r = dynamics::NetTorque<true>(*this, angles, {s.w1, s.w2}, {torque[0], torque[1]});
  const auto a = dynamics::AccelerationUnder(r, Mass(angles.c2));
  return {a.one, a.two};
}

Manipulator ManipulatorOf(const Plant& plant) {
  const auto links = LinksOf(plant);
  const auto& [m1, l1, c1, I1] = links[0];
  const auto& [m2, l2, c2, I2] = links[1];
  const double g = plant.gravity;
  Manipulator m;
  m.J1 = I1 + m1 * c1 * c1 + m2 * l1 * l1 + plant.own_armature1();
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
