#pragma once

#include "pendulum/plant.h"

namespace upswing {

/// Natural units of a double pendulum, as multiples of those of the built-in plant. The natural
/// time is sqrt(J / G), the natural torque is G: J is the inertia of the straight pendulum about
/// joint 1, with armatures (kg·m²), and G the largest torque of gravity about it (N·m).
///
/// Two plants of the same shape are the same plant in their natural units (Buckingham, Physical
/// Review 4 (1914)). What the task says in seconds, rad/s and N·m is therefore a multiple of them.
struct Scale {
  double time = 1;
  double torque = 1;

  double velocity() const { return 1 / time; }
  bool operator==(const Scale&) const = default;
};

/// The units `a` as multiples of the units `b`.
inline Scale operator/(const Scale& a, const Scale& b) {
  return {a.time / b.time, a.torque / b.torque};
}
inline Scale operator*(const Scale& a, const Scale& b) {
  return {a.time * b.time, a.torque * b.torque};
}

/// The natural time (s) and torque (N·m) of a plant.
Scale NaturalUnits(const Plant& plant);

/// The natural units of a plant over those of the built-in plant; exactly 1 for this plant.
Scale ScaleOf(const Plant& plant);

/// The units of `plant` as multiples of those of `from`, by which a policy for `from` acts on
/// `plant`. They are 1 unless `plant` has another size:
/// - its torques, or its lengths and times, differ by more than a factor of kOtherSize, or
/// - it is clearly nearer to the image of `from` in its own natural units than to `from` itself.
/// Where only the shape differs, such as one mass, a policy keeps its units.
Scale CarryOver(const Plant& from, const Plant& plant);
inline constexpr double kOtherSize = 3;
/// The largest distance to the image, over the distance to the plant itself, of a plant of another
/// size; distances are sums of |log ratio|.
inline constexpr double kClearlyNearer = 1.0 / 3;

/// The units by which the task of a plant counts, carried over from the built-in plant. For plants
/// of its size, seconds and N·m are the same in all rewards, observations and evaluations.
Scale TaskScaleOf(const Plant& plant);

}  // namespace upswing
