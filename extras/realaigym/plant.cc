#include "extras/realaigym/plant.h"

namespace upswing::realaigym {

Manipulator ManipulatorOf(const BoardPlant& p) {
  Manipulator m;
  m.J1 = p.inertia1 + p.mass2 * p.length1 * p.length1;
  m.J2 = p.inertia2;
  m.b = p.mass2 * p.length1 * p.center2;
  m.a = 0;
  m.G1 = p.gravity * (p.mass1 * p.center1 + p.mass2 * p.length1);
  m.G2 = p.gravity * p.mass2 * p.center2;
  m.d1 = p.damping1;
  m.d2 = p.damping2;
  m.f1 = p.friction1;
  m.f2 = p.friction2;
  m.AddRotors(p.rotor_inertia, kBoardGearRatio);
  return m;
}

}  // namespace upswing::realaigym
