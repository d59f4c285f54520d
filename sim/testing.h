#pragma once

#include <cmath>
#include <variant>

#include "core/options.h"
#include "core/rng.h"
#include "sim/double_pendulum.h"

/// What tests of the double pendulum share.
namespace upswing {

/// Parameters from the whole of their ranges, evenly on a logarithmic scale (or in the cube root,
/// where a range begins at 0).
inline Plant RandomPlant(Rng& rng) {
  Plant plant;
  const Options options = OptionsOf(plant);
  for (const Option& option : options.all()) {
    const auto& [low, high] = option.range;
    *std::get<double*>(option.target) = low > 0
                                            ? std::exp(rng.Uniform(std::log(low), std::log(high)))
                                            : high * std::pow(rng.Uniform(), 3);
    if (option.step > 0)
      *std::get<double*>(option.target) = std::round(*std::get<double*>(option.target));
  }
  return plant;
}

}  // namespace upswing
