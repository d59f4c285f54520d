#include "pendulum/scale.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "pendulum/equations.h"

namespace upswing {
namespace {

/// Whether two ratios are on the same side of 1, both by more than kOtherSize.
bool BothDiffer(double a, double b) {
  return std::min(a, b) > kOtherSize || std::max(a, b) * kOtherSize < 1;
}

/// The numbers without unit that decide a motion: the largest torque of the motor, inertias,
/// gravity, lengths, friction.
using Shape = std::array<double, 14>;

/// The shape of a plant in units of time (s), torque (N·m) and length (m).
Shape ShapeOf(const Plant& plant, const Scale& unit, double length) {
  // Armature and friction may be 0. Below this many units they hardly change a motion.
  constexpr double kNegligible = 0.02;
  const Manipulator body = ManipulatorOf(plant);
  const double inertia = unit.torque * unit.time * unit.time, damping = unit.torque * unit.time;
  // J2 may be negative with rotors, but not the diagonal of the mass matrix.
  const MassMatrix M = body.Mass(1);
  return {plant.torque_limit / unit.torque,
          M.M11 / inertia,
          M.M22 / inertia,
          body.b / inertia,
          body.G1 / unit.torque,
          body.G2 / unit.torque,
          plant.length1 / length,
          plant.length2 / length,
          plant.gravity * unit.time * unit.time / length,
          kNegligible + body.a / inertia,
          kNegligible + body.d1 / damping,
          kNegligible + body.d2 / damping,
          kNegligible + body.f1 / unit.torque,
          kNegligible + body.f2 / unit.torque};
}

/// The distances of two shapes, as |log ratio|: of the motors' torques, and the sum of all.
struct Distance {
  double limit, all = 0;

  Distance(const Shape& a, const Shape& b) {
    const auto of = [&](size_t i) { return std::abs(std::log(a[i] / b[i])); };
    limit = of(0);
    for (size_t i = 0; i < a.size(); ++i) all += of(i);
  }
};

/// Whether `plant` is clearly nearer to the image of `from` in its own units than to `from`. A
/// motor of the same torque is that of `from`, however heavy the links are.
bool IsImage(const Plant& from, const Plant& plant, const Scale& ratio) {
  constexpr double kSame = 0.01;  // |log ratio| of sizes and torques that are the same
  if (std::abs(std::log(ratio.time)) < kSame && std::abs(std::log(ratio.torque)) < kSame) {
    return false;
  }
  const Scale unit = NaturalUnits(from), own = unit * ratio;
  const double length = from.gravity * unit.time * unit.time;
  const double own_length = plant.gravity * own.time * own.time;
  const Shape original = ShapeOf(from, unit, length);
  const Distance to_plant(original, ShapeOf(plant, unit, length));
  const Distance to_image(original, ShapeOf(plant, own, own_length));
  return to_image.limit <= kClearlyNearer * to_plant.limit + kSame &&
         to_image.all <= kClearlyNearer * to_plant.all;
}

}  // namespace

Scale NaturalUnits(const Plant& plant) {
  const Manipulator body = ManipulatorOf(plant);
  const double J = body.Mass(1).M11, G = body.G1 + body.G2;
  return {std::sqrt(J / G), G};
}

Scale ScaleOf(const Plant& plant) {
  static const Scale kBuiltIn = NaturalUnits(Plant());
  return NaturalUnits(plant) / kBuiltIn;
}

Scale CarryOver(const Plant& from, const Plant& plant) {
  const Scale ratio = ScaleOf(plant) / ScaleOf(from);
  const double length = (plant.length1 + plant.length2) / (from.length1 + from.length2);
  const bool other_size = BothDiffer(ratio.torque, plant.torque_limit / from.torque_limit) ||
                          BothDiffer(ratio.time, length);
  return other_size || IsImage(from, plant, ratio) ? ratio : Scale();
}

Scale TaskScaleOf(const Plant& plant) { return CarryOver(Plant(), plant); }

}  // namespace upswing
