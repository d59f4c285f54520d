// Symbols: M mass matrix, D slopes of the friction (N·m·s/rad), see pendulum/equations.h.
#include "pendulum/timestep.h"

#include <algorithm>
#include <cmath>

#include "base/error.h"
#include "base/text.h"
#include "pendulum/scale.h"

namespace upswing {
namespace {

constexpr double kStable = 2.785;  // largest stable decay times step
constexpr double kResolved = 1;    // largest decay times step that follows the decay within 2%
// Longest step in natural times of the built-in plant, s. Twice that plant's own step would be too
// long for it.
constexpr double kLongestStep = 0.008;
constexpr double kShake = 0.2;  // rad/s; slower chatter of dry friction is accepted

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

/// The error that steps of `h` seconds are too long for a plant: its decay is above `largest`
/// (1/s).
Error TooStiff(const Plant& plant, const FastestDecay& decay, const std::string& where,
               double largest, double h) {
  const bool first = decay.joint == 1;
  const double damping = first ? plant.damping1 : plant.damping2;
  const double coulomb = first ? plant.coulomb1 : plant.coulomb2;
  return BadInput(Concat(where, ": expected friction that stops the joints at a rate of at most ",
                         largest, "/s, because time steps of ", h,
                         " s are too long beyond it, got ", decay.rate, "/s: damping", decay.joint,
                         " = ", damping, " N·m·s/rad and coulomb", decay.joint, " = ", coulomb,
                         " N·m act on ", decay.inertia, " kg·m²"));
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
  if (decay.rate * h <= kStable) return;
  throw TooStiff(plant, decay, where, kStable / h, h);
}

int PhysicsStepsFor(const Plant& plant, double period, const std::string& where) {
  const double time = ScaleOf(plant).time;
  const double longest = kLongestStep * time;
  const FastestDecay decay = FastestDecayOf(ManipulatorOf(plant));
  int steps = kPhysicsSteps;
  const double usual = kPhysicsTimestep * std::min(1.0, time);
  while (steps > 1 && period <= usual * steps / 2) steps /= 2;
  const auto resolves = [&] {
    return period <= longest * steps && decay.rate * period <= kResolved * steps;
  };
  while (!resolves() && steps < kMostPhysicsSteps) steps *= 2;
  if (decay.rate * period <= kResolved * steps) return steps;
  throw TooStiff(plant, decay, where, kResolved * steps / period, period / steps);
}

int PhysicsStepsFor(const Plant& nominal, const Randomization& random, double period,
                    const std::string& where) {
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
  int most = 1;
  for (int i = 0; i <= kSteps; ++i) {
    for (int j = 0; j <= kSteps; ++j) {
      plant.length1 = nominal.length1 * (1 + share1 * (2.0 * i / kSteps - 1));
      plant.length2 = nominal.length2 * (1 + share2 * (2.0 * j / kSteps - 1));
      most = std::max(most, PhysicsStepsFor(plant, period, where));
      if (share2 == 0) break;
    }
    if (share1 == 0) break;
  }
  return most;
}

}  // namespace upswing
