#include "control/swing_up.h"

#include <gtest/gtest.h>

#include "base/rng.h"

namespace upswing {
namespace {

/// q̈ under a torque.
Eigen::Vector2d Acceleration(const Manipulator& plant, const StateVector& x, double u) {
  const auto a = plant.Acceleration(StateOf(x), {u, 0});
  return {a[0], a[1]};
}

StateVector DrawDeviation(Rng& rng) {
  return {rng.Uniform(-3, 3), rng.Uniform(-3, 3), rng.Uniform(-5, 5), rng.Uniform(-5, 5)};
}

TEST(SwingUp, PartialFeedbackGivesLinkOneItsAcceleration) {
  const Manipulator plant = ManipulatorOf(Plant());
  PartialFeedbackConfig config;
  Rng rng(1, "states");
  for (int trial = 0; trial < 200; ++trial) {
    const StateVector d = DrawDeviation(rng), x = FromUpright(d);
    const double expected =
        -config.kP * d[0] - config.kD * d[2] - config.kE * plant.At(StateOf(x)).energy * d[2];
    const double u = PartialFeedbackTorque(config, plant, d);
    EXPECT_NEAR(Acceleration(plant, x, u)[0], expected, 1e-9 * (1 + std::abs(expected)));
  }
}

TEST(SwingUp, EnergyShapingLetsTheFunctionOfLyapunovFall) {
  Plant frictionless;
  frictionless.damping1 = frictionless.damping2 = 0;
  const Manipulator plant = ManipulatorOf(frictionless);
  EnergyShapingConfig config;
  const auto V = [&](const StateVector& x) {
    const double E = plant.At(StateOf(x)).energy, q = x[0] - std::numbers::pi;
    return (config.kE * E * E + config.kD * x[2] * x[2] + config.kP * q * q) / 2;
  };
  Rng rng(2, "states");
  for (int trial = 0; trial < 200; ++trial) {
    const StateVector d = DrawDeviation(rng), x = FromUpright(d);
    const double u = EnergyShapingTorque(config, plant, d);
    if (std::abs(u) > 100) continue;  // near the pole of the torque
    const Eigen::Vector2d a = Acceleration(plant, x, u);
    const StateVector rate(x[2], x[3], a[0], a[1]);
    constexpr double e = 1e-6;
    const double slope = (V(x + e * rate) - V(x - e * rate)) / (2 * e);
    EXPECT_NEAR(slope, -d[2] * d[2], 1e-4 * (1 + d[2] * d[2]));
  }
}

}  // namespace
}  // namespace upswing
