#include "pendulum/equations.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>

#include "base/rng.h"
#include "pendulum/closed_form.h"
#include "pendulum/testing.h"

namespace upswing {
namespace {

/// The given number, or the usual one if it is 0.
double Or(double given, double usual) { return given != 0 ? given : usual; }

/// Kinetic minus potential energy (J) from the positions and velocities of the bodies: two swinging
/// links, an armature at each joint, and two rotors.
double Lagrangian(const Plant& p, const std::array<double, 4>& x) {
  const auto& [q1, q2, w1, w2] = x;
  const double q12 = q1 + q2, w12 = w1 + w2;
  const auto square = [](double v) { return v * v; };
  const auto link = [&](double m, double I, double w, double vx, double vz, double z) {
    return (m * (vx * vx + vz * vz) + I * w * w) / 2 - m * p.gravity * z;
  };
  const double l1 = p.length1, l2 = p.length2, c1 = Or(p.center1, l1 / 2);
  const double c2 = Or(p.center2, l2 / 2);
  const double I1 = Or(p.inertia1, CapsuleInertia(p.mass1, kCapsuleRadius, l1).across);
  const double I2 = Or(p.inertia2, CapsuleInertia(p.mass2, kCapsuleRadius, l2).across);
  const double upper =
      link(p.mass1, I1, w1, c1 * w1 * std::cos(q1), c1 * w1 * std::sin(q1), -c1 * std::cos(q1));
  const double lower = link(p.mass2, I2, w12, l1 * w1 * std::cos(q1) + c2 * w12 * std::cos(q12),
                            l1 * w1 * std::sin(q1) + c2 * w12 * std::sin(q12),
                            -l1 * std::cos(q1) - c2 * std::cos(q12));
  const double armature1 = p.armature1 < 0 ? p.armature : p.armature1;
  const double armatures = (armature1 * w1 * w1 + p.armature * w2 * w2) / 2;
  const double rotors =
      p.rotor_inertia / 2 * (square(p.gear_ratio * w1) + square(w1 - p.gear_ratio * w2));
  return upper + lower + armatures + rotors;
}

/// x with coordinate `i` changed by h.
std::array<double, 4> Moved(std::array<double, 4> x, size_t i, double h) {
  x[i] += h;
  return x;
}

/// Left side of Lagrange's equations, d/dt ∂L/∂q̇ - ∂L/∂q, for accelerations a, by differences.
double GeneralizedForce(const Plant& p, const std::array<double, 4>& x,
                        const std::array<double, 2>& a, size_t joint) {
  constexpr double h = 1e-4;
  const auto momentum = [&](const std::array<double, 4>& at) {
    // L is quadratic in the velocities, so a central difference is exact.
    return (Lagrangian(p, Moved(at, 2 + joint, 1)) - Lagrangian(p, Moved(at, 2 + joint, -1))) / 2;
  };
  const std::array<double, 4> rate{x[2], x[3], a[0], a[1]};
  const auto later = [&](double t) {
    std::array<double, 4> at = x;
    for (size_t k = 0; k < 4; ++k) at[k] += t * rate[k];
    return at;
  };
  const double change = (momentum(later(h)) - momentum(later(-h))) / (2 * h);
  const double slope =
      (Lagrangian(p, Moved(x, joint, h)) - Lagrangian(p, Moved(x, joint, -h))) / (2 * h);
  return change - slope;
}

TEST(Manipulator, SatisfiesLagrangesEquations) {
  Rng rng(1, "plants");
  for (int trial = 0; trial < 200; ++trial) {
    Plant p;
    for (double* x : {&p.mass1, &p.mass2, &p.length1, &p.length2}) *x = rng.Uniform(0.3, 2);
    p.damping1 = rng.Uniform(0, 1);
    p.damping2 = rng.Uniform(0, 1);
    p.rotor_inertia = rng.Uniform(0, 1e-3);
    p.gear_ratio = rng.Uniform(0, 10);
    p.coulomb1 = rng.Uniform(0, 0.5);
    p.coulomb2 = rng.Uniform(0, 0.5);
    if (trial % 4 == 3) p.armature1 = rng.Uniform(0, 0.1);
    if (trial % 2 == 1) {
      for (double* x : {&p.center1, &p.center2}) *x = rng.Uniform(0.1, 2);
      for (double* x : {&p.inertia1, &p.inertia2}) *x = rng.Uniform(0.01, 1);
      p.armature = rng.Uniform(0, 0.1);
    }
    const PendulumState s{rng.Uniform(-3, 3), rng.Uniform(-3, 3), rng.Uniform(-2, 2),
                          rng.Uniform(-0.03, 0.03)};
    const std::array<double, 2> tau{rng.Uniform(-5, 5), rng.Uniform(-5, 5)};
    const auto a = ManipulatorOf(p).Acceleration(s, tau);
    const std::array<double, 4> x{s.q1, s.q2, s.w1, s.w2};
    const std::array<double, 2> friction{p.damping1 * s.w1 + p.coulomb1 * std::atan(100 * s.w1),
                                         p.damping2 * s.w2 + p.coulomb2 * std::atan(100 * s.w2)};
    for (const size_t joint : {0, 1}) {
      // The differences have an error of about h² times third derivatives, some 10² of the largest
      // term.
      const double scale = 10 + std::abs(a[0]) + std::abs(a[1]);
      EXPECT_NEAR(GeneralizedForce(p, x, a, joint), tau[joint] - friction[joint], 1e-5 * scale)
          << trial << ", joint " << joint + 1;
    }
  }
}

TEST(Manipulator, EnergyIsThatOfTheLagrangian) {
  Rng rng(2, "plants");
  for (int trial = 0; trial < 100; ++trial) {
    const Plant p = RandomMachine(rng);
    const PendulumState s{rng.Uniform(-3, 3), rng.Uniform(-3, 3), rng.Uniform(-5, 5),
                          rng.Uniform(-5, 5)};
    const double resting = Lagrangian(p, {s.q1, s.q2, 0, 0});
    const double upright = Lagrangian(p, {std::acos(-1.0), 0, 0, 0});
    const double expected = Lagrangian(p, {s.q1, s.q2, s.w1, s.w2}) - 2 * resting + upright;
    EXPECT_NEAR(ManipulatorOf(p).At(s).energy, expected,
                1e-11 * (1 + std::abs(resting)) + 1e-12 * std::abs(expected));
  }
}

TEST(Manipulator, TheTaskHasTheTrueEnergyOfOwnLinks) {
  Rng rng(5, "plants");
  for (int trial = 0; trial < 100; ++trial) {
    Plant p = RandomMachine(rng);
    p.armature = p.armature1 = p.rotor_inertia = 0;
    if (!p.has_own_links()) p.inertia1 = 0.05;
    const Manipulator m = ManipulatorOf(p);
    const PendulumState s{rng.Uniform(-3, 3), rng.Uniform(-3, 3), rng.Uniform(-5, 5),
                          rng.Uniform(-5, 5)};
    const double energy = Energy(p, s);  // 0 at the height of the pivot
    EXPECT_NEAR(energy, m.At(s).energy + m.G1 + m.G2, 1e-11 * (1 + std::abs(energy)));
    // 0 hanging, 1 upright, with the true moments of gravity.
    EXPECT_NEAR(EnergyTarget(p), m.G1 + m.G2, 1e-13 * (m.G1 + m.G2));
    EXPECT_NEAR(NormalizedEnergy(p, {}), 0, 1e-14);
    EXPECT_NEAR(NormalizedEnergy(p, {std::acos(-1.0), 0, 0, 0}), 1, 1e-14);
  }
}

void Set(ClosedFormBatch& batch, size_t i, const Plant& plant, const PendulumState& s, double tau) {
  batch.SetPlant(i, plant);
  batch.SetState(i, s);
  batch.tau[i] = tau;
}

TEST(Manipulator, IsWhatTheClosedFormSteps) {
  Rng rng(3, "plants");
  for (int trial = 0; trial < 200; ++trial) {
    const Plant plant = RandomMachine(rng);
    const Manipulator manipulator = ManipulatorOf(plant);
    const PendulumState s{rng.Uniform(-3, 3), rng.Uniform(-3, 3), rng.Uniform(-5, 5),
                          rng.Uniform(-5, 5)};
    const double tau = rng.Uniform(-5, 5);
    const bool first = plant.actuated_joint == 1;
    const std::array<double, 2> torque{first ? tau : 0, first ? 0 : tau};
    // A classical Runge-Kutta step, written out.
    using X = std::array<double, 4>;
    const auto slope = [&](const X& x) -> X {
      const auto a = manipulator.Acceleration({x[0], x[1], x[2], x[3]}, torque);
      return {x[2], x[3], a[0], a[1]};
    };
    const auto along = [](X x, const X& k, double h) {
      for (size_t i = 0; i < 4; ++i) x[i] += h * k[i];
      return x;
    };
    constexpr double h = 0.002;
    const X x{s.q1, s.q2, s.w1, s.w2};
    const X k1 = slope(x), k2 = slope(along(x, k1, h / 2)), k3 = slope(along(x, k2, h / 2));
    const X k4 = slope(along(x, k3, h));
    ClosedFormBatch batch(1);
    Set(batch, 0, plant, s, tau);
    Advance(batch, 1, 0, 1, h);
    const X got{batch.q1[0], batch.q2[0], batch.w1[0], batch.w2[0]};
    // The formulas of det M differ: links of very different length lose digits in M11 M22 - M12².
    const MassMatrix M = manipulator.Mass(std::cos(s.q2));
    const double lost = std::max(1.0, M.M11 * M.M22 / M.det / 100);
    for (size_t i = 0; i < 4; ++i) {
      const double expected = x[i] + h / 6 * (k1[i] + 2 * k2[i] + 2 * k3[i] + k4[i]);
      const double scale = 1 + std::abs(expected) + std::abs(h * k1[2]) + std::abs(h * k1[3]);
      EXPECT_NEAR(got[i], expected, 1e-12 * lost * scale) << trial << ", " << i;
    }
  }
}

TEST(Manipulator, APlantWithoutDryFrictionMovesTheSameNextToOneWithIt) {
  Rng rng(4, "plants");
  for (int trial = 0; trial < 50; ++trial) {
    Plant plant, rough;
    plant.mass2 = rng.Uniform(0.5, 2);
    rough.coulomb2 = 0.01;
    const PendulumState s{rng.Uniform(-3, 3), rng.Uniform(-3, 3), rng.Uniform(-5, 5),
                          rng.Uniform(-5, 5)};
    ClosedFormBatch alone(1), both(2);
    Set(alone, 0, plant, s, 1);
    Set(both, 0, plant, s, 1);
    Set(both, 1, rough, s, 1);
    EXPECT_FALSE(alone.dry_friction);
    EXPECT_TRUE(both.dry_friction);
    Advance(alone, 4, 0, 1);
    Advance(both, 4, 0, 2);
    EXPECT_EQ(alone.q1[0], both.q1[0]);
    EXPECT_EQ(alone.q2[0], both.q2[0]);
    EXPECT_EQ(alone.w1[0], both.w1[0]);
    EXPECT_EQ(alone.w2[0], both.w2[0]);
  }
}

TEST(Manipulator, DryFrictionBringsAPendulumToRest) {
  Plant plant;
  plant.damping1 = plant.damping2 = 0;
  plant.coulomb1 = plant.coulomb2 = 0.05;
  ClosedFormBatch batch(1);
  Set(batch, 0, plant, {0.4, -0.2, 0, 0}, 0);
  Advance(batch, 12000, 0, 1);
  // The amplitude decays linearly and ends in a creep at c · 100 · w = moment of gravity.
  EXPECT_LT(std::abs(batch.w1[0]), 1e-2);
  EXPECT_LT(std::abs(batch.w2[0]), 1e-2);
  EXPECT_LT(std::abs(batch.q1[0]), 0.05);
}

}  // namespace
}  // namespace upswing
