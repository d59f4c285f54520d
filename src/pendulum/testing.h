#pragma once

#include <array>
#include <cmath>
#include <numbers>
#include <span>

#include "base/error.h"
#include "base/options.h"
#include "base/rng.h"
#include "pendulum/plant.h"
#include "pendulum/timestep.h"

/// Helpers that the tests of the double pendulum share.
namespace upswing {

inline constexpr double kPi = std::numbers::pi;

/// Whether the physics' steps are stable for a plant.
inline bool IsStable(const Plant& plant) {
  try {
    CheckTimestep(plant, "plant", kPhysicsTimestep);
  } catch (const Error&) {
    return false;
  }
  return true;
}

/// A plant with parameters drawn from wide ranges, without rotors and dry friction, for
/// which the physics' steps are stable. Parameters are uniform on a logarithmic scale, or in the
/// cube root where a range begins at 0.
inline Plant RandomPlant(Rng& rng) {
  constexpr std::array<Range, kMainParameters> kRanges{{{0.01, 100},
                                                        {0.01, 100},
                                                        {0.1, 10},
                                                        {0.1, 10},
                                                        {0, 100},
                                                        {0, 100},
                                                        {0.01, 100},
                                                        {0.01, 1000}}};
  Plant plant;
  for (size_t k = 0; k < kMainParameters; ++k) {
    const auto& [low, high] = kRanges.at(k);
    plant.*kPlantParameters.at(k).value = low > 0
                                              ? std::exp(rng.Uniform(std::log(low), std::log(high)))
                                              : high * std::pow(rng.Uniform(), 3);
  }
  plant.actuated_joint = std::round(std::exp(rng.Uniform(std::log(1), std::log(2))));
  return IsStable(plant) ? plant : RandomPlant(rng);
}

/// A RandomPlant with rotors and dry friction, both small enough for the physics' steps. It has its
/// own armatures, and often own centres of mass and inertias.
inline Plant RandomMachine(Rng& rng) {
  Plant plant = RandomPlant(rng);
  const double inertia = plant.mass2 * plant.length2 * plant.length2;  // about link 2's
  plant.gear_ratio = rng.Uniform(0, 10);
  plant.rotor_inertia = rng.Uniform(0, 0.1) * inertia;
  plant.coulomb1 = rng.Uniform(0, 0.2) * inertia;
  plant.coulomb2 = rng.Uniform(0, 0.2) * inertia;
  plant.armature = rng.Uniform(0.001, 0.05);
  if (rng.Uniform() < 0.5) plant.armature1 = rng.Uniform(0, 0.05);
  const auto often = [&](double value) { return rng.Uniform() < 0.7 ? value : 0; };
  plant.center1 = often(rng.Uniform(0.2, 1.2) * plant.length1);
  plant.center2 = often(rng.Uniform(0.2, 1.2) * plant.length2);
  plant.inertia1 = often(rng.Uniform(0.02, 0.3) * plant.mass1 * plant.length1 * plant.length1);
  plant.inertia2 = often(rng.Uniform(0.02, 0.3) * plant.mass2 * plant.length2 * plant.length2);
  return IsStable(plant) ? plant : RandomMachine(rng);
}

}  // namespace upswing
