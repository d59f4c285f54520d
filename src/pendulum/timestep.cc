// Symbols: M mass matrix, D slopes of the friction (N·m·s/rad), see pendulum/equations.h.
#include "pendulum/timestep.h"

#include <algorithm>
#include <cmath>

#include "base/error.h"
#include "base/text.h"

namespace upswing {
namespace {

constexpr double kStable = 2.785;  // largest decay times step
constexpr double kShake = 0.2;     // rad/s; slower chatter of dry friction is accepted

/// Slope (N·m·s/rad) from rest to kShake.
double Slope(double damping, double friction) {
  return damping + DryFriction(friction, kShake) / kShake;
}

FastestDecay DecayAt(const Manipulator& body, double cos_q2) {
  const MassMatrix M = body.Mass(cos_q2);
  const double D1 = Slope(body.d1, body.f1), D2 = Slope(body.d2, body.f2);
  // The eigenvalues of M⁻¹ D are real and at least 0.
  const double r1 = M.M22 * D1 / M.det, r2 = M.M11 * D2 / M.det;
  const double half = (r1 + r2) / 2, product = D1 * D2 / M.det;
  const double rate = half + std::sqrt(std::max(0.0, half * half - product));
  if (r1 > r2) return {rate, 1, M.det / M.M22};
  return {rate, 2, M.det / M.M11};
}

}  // namespace

FastestDecay FastestDecayOf(const Manipulator& body) {
  // M is affine in cos q2, so its smallest eigenvalue relative to D is concave: it is smallest at
  // an end.
  const FastestDecay stretched = DecayAt(body, 1), folded = DecayAt(body, -1);
  return stretched.rate > folded.rate ? stretched : folded;
}

void CheckTimestep(const Plant& plant, const std::string& where, double h) {
  const FastestDecay decay = FastestDecayOf(ManipulatorOf(plant));
  const double largest = kStable / h;
  if (decay.rate <= largest) return;
  const bool first = decay.joint == 1;
  const double damping = first ? plant.damping1 : plant.damping2;
  const double coulomb = first ? plant.coulomb1 : plant.coulomb2;
  throw BadInput(Concat(where, ": expected friction that stops the joints at a rate of at most ",
                        largest, "/s, because time steps of ", h, " s are unstable beyond it, got ",
                        decay.rate, "/s: damping", decay.joint, " = ", damping,
                        " N·m·s/rad and coulomb", decay.joint, " = ", coulomb, " N·m act on ",
                        decay.inertia, " kg·m²"));
}

void CheckTimestep(const Plant& nominal, const Randomization& random, const std::string& where) {
  constexpr int kSteps = 4;  // of each length, which has no worst end
  const auto share = [&](double Plant::*parameter) {
    for (size_t k = 0; k < random.plant.size(); ++k) {
      if (kPlantParameters.at(k).value == parameter) return random.plant.at(k);
    }
    return 0.0;
  };
  // Light links and strong damping are worst.
  Plant plant = nominal;
  for (double Plant::*mass : {&Plant::mass1, &Plant::mass2}) plant.*mass *= 1 - share(mass);
  for (double Plant::*damping : {&Plant::damping1, &Plant::damping2}) {
    plant.*damping *= 1 + share(damping);
  }
  const double share1 = share(&Plant::length1), share2 = share(&Plant::length2);
  for (int i = 0; i <= kSteps; ++i) {
    for (int j = 0; j <= kSteps; ++j) {
      plant.length1 = nominal.length1 * (1 + share1 * (2.0 * i / kSteps - 1));
      plant.length2 = nominal.length2 * (1 + share2 * (2.0 * j / kSteps - 1));
      CheckTimestep(plant, where);
      if (share2 == 0) break;
    }
    if (share1 == 0) break;
  }
}

}  // namespace upswing
