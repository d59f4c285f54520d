#include "pendulum/scale.h"

#include <algorithm>
#include <cmath>

#include "pendulum/equations.h"

namespace upswing {
namespace {

/// Natural time (s) and torque (N·m).
Scale NaturalUnits(const Plant& plant) {
  const Manipulator body = ManipulatorOf(plant);
  const double J = body.Mass(1).M11, G = body.G1 + body.G2;
  return {std::sqrt(J / G), G};
}

/// Whether two ratios are on the same side of 1, both by more than kOtherSize.
bool BothDiffer(double a, double b) {
  return std::min(a, b) > kOtherSize || std::max(a, b) * kOtherSize < 1;
}

}  // namespace

Scale ScaleOf(const Plant& plant) {
  static const Scale kBuiltIn = NaturalUnits(Plant());
  return NaturalUnits(plant) / kBuiltIn;
}

Scale CarryOver(const Plant& from, const Plant& plant) {
  const Scale ratio = ScaleOf(plant) / ScaleOf(from);
  const double length = (plant.length1 + plant.length2) / (from.length1 + from.length2);
  const bool other_size = BothDiffer(ratio.torque, plant.torque_limit / from.torque_limit) ||
                          BothDiffer(ratio.time, length);
  return other_size ? ratio : Scale();
}

Scale TaskScaleOf(const Plant& plant) { return CarryOver(Plant(), plant); }

}  // namespace upswing
