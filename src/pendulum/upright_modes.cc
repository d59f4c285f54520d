#include "pendulum/upright_modes.h"

#include <cmath>

namespace upswing {
namespace {

/// Sets the pole and delta of the joint without a motor.
void SetPassiveJoint(const Manipulator& plant, int actuated_joint, UprightModes& modes) {
  const double J2 = plant.J2, b = plant.b, G2 = plant.G2;
  const auto growth = [](double inertia, double damping, double gravity) {
    return (std::sqrt(damping * damping + 4 * inertia * gravity) - damping) / (2 * inertia);
  };
  if (actuated_joint == 2) {
    // Joint 1 without torque: M11 q̈1 + d1 q̇1 - (G1 + G2) q1 = -(M12 q̈2 - G2 q2). If pole and
    // zero coincide, both sides are 0 at one rate, and no torque reaches that mode.
    const double pole = growth(plant.J1 + J2 + 2 * b, plant.d1, plant.G1 + G2);
    const double zero = std::sqrt(G2 / (J2 + b));
    modes.pole = pole;
    modes.delta = (zero - pole) / (zero + pole);
    return;
  }
  // Link 2 in absolute angles φ1, φ2: n12 φ̈1 + n22 φ̈2 + d2 (φ̇2 - φ̇1) = G2 φ2. Its zero is
  // z = d2 / n12. n12 may be 0, so both parts of delta are multiplied by n12.
  const double n12 = b - plant.a, pole = growth(J2 + plant.a, plant.d2, G2);
  modes.pole = pole;
  modes.delta = (plant.d2 - pole * n12) / (plant.d2 + pole * n12);
}

}  // namespace

UprightModes ModesOf(const Manipulator& plant, int actuated_joint) {
  const double G2 = plant.G2, d1 = plant.d1, d2 = plant.d2;
  const auto [M11, M12, M22, det] = plant.Mass(1);
  // K(λ) = M λ² + D λ - G about upright; K(λ) y = 0 for a mode of rate λ. Its determinant is
  // k4 λ⁴ + k3 λ³ + k2 λ² + k1 λ + k0.
  const double G = plant.G1 + G2;
  const double k4 = det, k3 = M11 * d2 + M22 * d1;
  const double k2 = d1 * d2 - M11 * G2 - M22 * G + 2 * M12 * G2;
  const double k1 = -d1 * G2 - d2 * G, k0 = plant.G1 * G2;

  // The roots are real, and two are above 0. Newton's method descends from above to the largest
  // root. On the cubic without that root it descends to the next one.
  const auto newton = [](double x, double c4, double c3, double c2, double c1, double c0) {
    for (int i = 0; i < 50; ++i) {
      const double value = (((c4 * x + c3) * x + c2) * x + c1) * x + c0;
      const double slope = ((4 * c4 * x + 3 * c3) * x + 2 * c2) * x + c1;
      const double step = value / slope;
      x -= step;
      if (!(std::abs(step) > 1e-12 * x)) break;
    }
    return x;
  };
  // Without damping, λ² is a root of a quadratic; damping makes each root smaller.
  const double undamped = -M11 * G2 - M22 * G + 2 * M12 * G2;
  const double start =
      std::sqrt((-undamped + std::sqrt(undamped * undamped - 4 * k4 * k0)) / (2 * k4));
  const double fast = newton(start, k4, k3, k2, k1, k0);
  // Division by (λ - fast): c3 λ³ + c2 λ² + c1 λ + c0
  const double c3 = k4, c2 = k3 + fast * c3, c1 = k2 + fast * c2, c0 = k1 + fast * c1;
  const double slow = newton(fast, 0, c3, c2, c1, c0);
  UprightModes modes{fast, slow, 0, 0};
  SetPassiveJoint(plant, actuated_joint, modes);
  return modes;
}

UprightModes ModesOf(const Plant& plant) {
  return ModesOf(ManipulatorOf(plant), static_cast<int>(plant.actuated_joint));
}

Falling FallingOf(const Manipulator& plant, const Plant& motor, const PendulumState& s) {
  const auto joint = static_cast<int>(motor.actuated_joint);
  Falling falling{ModesOf(plant, joint), {}, 0};
  const double G2 = plant.G2, d1 = plant.d1, d2 = plant.d2, G = plant.G1 + G2;
  const auto [M11, M12, M22, det] = plant.Mass(1);
  const std::array rates{falling.faster, falling.slower};
  // z = y' (M w + (M λ + D) q) grows as ż = λ z + y1 u, or y2 u of a motor at joint 2.
  const auto lean = Lean(s);
  const double q1 = lean[0], q2 = lean[1] - lean[0];
  for (size_t i = 0; i < 2; ++i) {
    const double rate = rates[i];
    const double K11 = (M11 * rate + d1) * rate - G, K12 = M12 * rate * rate - G2;
    const double K22 = (M22 * rate + d2) * rate - G2;
    const bool first = std::abs(K11) > std::abs(K22);
    const double y1 = first ? -K12 : K22, y2 = first ? K11 : -K12;
    const double z = y1 * (M11 * s.w1 + M12 * s.w2 + (M11 * rate + d1) * q1 + M12 * rate * q2) +
                     y2 * (M12 * s.w1 + M22 * s.w2 + M12 * rate * q1 + (M22 * rate + d2) * q2);
    falling.zeta[i] = rate * z / ((joint == 1 ? y1 : y2) * motor.torque_limit);
  }
  // The gain that moves both poles to their mirror images: Anderson, Moore, section 4.3.
  const auto [fast, slow] = rates;
  falling.torque = -2 * (fast + slow) / (fast - slow) * (falling.zeta[0] - falling.zeta[1]);
  return falling;
}

}  // namespace upswing
