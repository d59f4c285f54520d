// Rotors of motors with gears.
#include "pendulum/equations.h"

namespace upswing {

void Manipulator::AddRotors(double inertia, double gear) {
  // The rotors' kinetic energy I/2 ((gear w1)² + (w1 - gear w2)²) adds (gear² + 1) I to M11, -gear
  // I to M12 and gear² I to M22.
  J1 += (gear * gear + gear + 1) * inertia;
  J2 -= gear * inertia;
  a += (gear * gear + gear) * inertia;
}

}  // namespace upswing
