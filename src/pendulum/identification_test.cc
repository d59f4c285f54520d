#include "pendulum/identification.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>

#include "base/rng.h"
#include "pendulum/closed_form.h"
#include "pendulum/randomization.h"
#include "pendulum/testing.h"

namespace upswing {
namespace {

/// The standard plant with each parameter changed by at most the relative amount `share`.
Plant Near(double share, Rng& rng) {
  Randomization box;
  box.plant.fill(share);
  return box.Draw(Plant(), rng);
}

/// The state of a plant one control period later.
PendulumState Move(const Plant& plant, const PendulumState& s, double torque) {
  ClosedFormBatch batch(1);
  batch.SetPlant(0, plant);
  batch.SetState(0, s);
  batch.SetTorque({&torque, 1});
  Advance(batch, kPhysicsSteps, 0, 1);
  return batch.state(0);
}

TEST(Falling, EachModeMovesByItself) {
  // ż = λ z + gain u with u held. In units of the motor's limit, ζ grows to e^(λh) ζ + (e^(λh) - 1)
  // u/u*. The physics agrees next to upright.
  Rng rng(1, "test");
  for (int n = 0; n < 40; ++n) {
    Plant plant = Near(0.5, rng);
    plant.actuated_joint = n % 2 + 1;
    const Manipulator constants = ManipulatorOf(plant);
    // Rounding hides the square of a deviation of 1e-5; the torque has the same size.
    const auto small = [&] { return 1e-5 * rng.Uniform(-1, 1); };
    const PendulumState before{kPi + small(), small(), small(), small()};
    const double torque = plant.torque_limit * small();
    const PendulumState after = Move(plant, before, torque);
    const Falling falling = FallingOf(constants, plant, before);
    const Falling later = FallingOf(constants, plant, after);
    const std::array rates{falling.faster, falling.slower};
    ASSERT_GT(rates[0], rates[1]);
    ASSERT_GT(rates[1], 0);
    for (size_t i = 0; i < 2; ++i) {
      const double growth = std::exp(rates[i] * kControlPeriod);
      const double expected = growth * falling.zeta[i] + (growth - 1) * torque / plant.torque_limit;
      // A Runge-Kutta step has an error of (λ h)⁵/120 of ζ, which is 1e-9 for λ = 8.
      const double size = std::max(std::abs(falling.zeta[i]), 1e-5);
      EXPECT_NEAR(later.zeta[i], expected, 1e-6 * size) << "plant " << n << ", mode " << i;
    }
  }
}

TEST(Falling, TheTorqueEndsBothFalls) {
  for (const double joint : {1.0, 2.0}) {
    Plant plant;
    plant.actuated_joint = joint;
    const Manipulator constants = ManipulatorOf(plant);
    PendulumState s{kPi + 2e-6, -3e-6, 1e-6, 0};
    const Falling start = FallingOf(constants, plant, s);
    for (int step = 0; step < 300; ++step) {
      s = Move(plant, s, plant.torque_limit * FallingOf(constants, plant, s).torque);
    }
    const Falling end = FallingOf(constants, plant, s);
    for (size_t i = 0; i < 2; ++i) {
      // The modes decay by exp(-3.6 · 6 s) = 4e-10 or more; holding the torque for 0.02 s makes
      // this less exact.
      EXPECT_LT(std::abs(end.zeta[i]), 1e-3 * std::abs(start.zeta[0])) << joint;
    }
  }
}

TEST(Identifier, FindsTheConstants) {
  for (const double joint : {1.0, 2.0}) {
    Rng rng(2, "test");
    Plant nominal, plant = Near(0.2, rng);
    nominal.actuated_joint = plant.actuated_joint = joint;
    Identifier identifier(nominal, kControlPeriod, 1);
    PendulumState s{0.1, -0.2, 0.3, 0};
    identifier.Begin(0, s);
    double torque = 0;
    for (int step = 0; step < 300; ++step) {
      if (step % 5 == 0) torque = rng.Uniform(-5, 5);
      s = Move(plant, s, torque);
      identifier.Update(0, torque, s);
    }
    const Manipulator truth = ManipulatorOf(plant), found = identifier.estimate(0);
    for (const auto constant : kIdentified) {
      EXPECT_NEAR(found.*constant / truth.*constant, 1, 0.01) << "motor at joint " << joint;
    }
  }
}

TEST(Identifier, TheEnergyIsThatOfTheMotion) {
  // Energy is conserved without damping and torque. No other number of the task distinguishes this
  // plant from others.
  Plant plant;
  plant.damping1 = plant.damping2 = 0;
  Identifier identifier(plant, kControlPeriod, 1);
  PendulumState s{2, -1, 3, 1};
  identifier.Begin(0, s);
  std::array<float, kIdentifiedSize> numbers;
  const auto energy = [&] {
    identifier.Observe(0, s, numbers);
    return numbers[kConstants + 2];
  };
  const float start = energy();
  for (int step = 0; step < 50; ++step) s = Move(plant, s, 0);
  EXPECT_NEAR(energy(), start, 1e-5);
  s = {};
  EXPECT_NEAR(energy(), 0, 1e-6);
  s = {kPi, 0, 0, 0};
  EXPECT_NEAR(energy(), 1, 1e-6);
}

TEST(Identifier, StaysFiniteWhateverIsMeasured) {
  Identifier identifier(Plant(), kControlPeriod, 1);
  identifier.Begin(0, {});
  Rng rng(3, "test");
  std::array<float, kIdentifiedSize> numbers;
  for (int step = 0; step < 2000; ++step) {
    const double size = std::pow(10, rng.Uniform(-3, 6));
    const auto any = [&] { return size * rng.Uniform(-1, 1); };
    const PendulumState s{any(), any(), any(), any()};
    identifier.Update(0, any(), s);
    identifier.Observe(0, s, numbers);
    for (const float x : numbers) ASSERT_TRUE(std::isfinite(x)) << step;
  }
}

}  // namespace
}  // namespace upswing
