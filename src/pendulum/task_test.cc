#include "pendulum/task.h"

#include <gtest/gtest.h>

#include <cmath>
#include <numeric>

#include "base/rng.h"
#include "pendulum/testing.h"

namespace upswing {
namespace {

Plant ModeratePlant(Rng& rng) {
  Plant p;
  for (double* x : {&p.mass1, &p.mass2, &p.length1, &p.length2}) *x = rng.Uniform(0.2, 2);
  p.gravity = rng.Uniform(1, 20);
  return p;
}

PendulumState RandomState(Rng& rng) {
  return {rng.Uniform(-4, 4), rng.Uniform(-4, 4), rng.Uniform(-8, 8), rng.Uniform(-8, 8)};
}

TEST(Energy, HangingAndInvertedAreMinusAndPlusTheTarget) {
  const Plant plant;
  EXPECT_DOUBLE_EQ(EnergyTarget(plant), 9.81);
  EXPECT_DOUBLE_EQ(Energy(plant, {}), -9.81);
  EXPECT_NEAR(Energy(plant, {kPi, 0, 0, 0}), 9.81, 1e-14);
  EXPECT_DOUBLE_EQ(NormalizedEnergy(plant, {}), 0);
  EXPECT_NEAR(NormalizedEnergy(plant, {kPi, 0, 0, 0}), 1, 1e-15);
}

TEST(Energy, MatchesRodsCutIntoPieces) {
  // A second derivation: each rod is a row of point masses, with positions and velocities from the
  // geometry. Midpoint pieces underestimate a rod's inertia by the share 1/n².
  Rng rng(1, "energy");
  constexpr int n = 2000;
  for (int trial = 0; trial < 20; ++trial) {
    const Plant p = ModeratePlant(rng);
    const PendulumState s = RandomState(rng);
    const double a = s.q1 + s.q2;
    const double wa = s.w1 + s.w2;
    double energy = 0;
    for (int i = 0; i < n; ++i) {
      const double r = (i + 0.5) / n;
      const double r1 = r * p.length1;
      const double r2 = r * p.length2;
      energy += p.mass1 / n * (0.5 * std::pow(r1 * s.w1, 2) - p.gravity * r1 * std::cos(s.q1));
      const double vx = p.length1 * s.w1 * std::cos(s.q1) + r2 * wa * std::cos(a);
      const double vz = p.length1 * s.w1 * std::sin(s.q1) + r2 * wa * std::sin(a);
      const double z = -p.length1 * std::cos(s.q1) - r2 * std::cos(a);
      energy += p.mass2 / n * (0.5 * (vx * vx + vz * vz) + p.gravity * z);
    }
    EXPECT_NEAR(Energy(p, s), energy, 1e-4);
  }
}

TEST(TipHeight, HasItsExtremesHangingAndInverted) {
  Plant plant;
  plant.length2 = 0.3;
  EXPECT_DOUBLE_EQ(TipHeight(plant, {}), -0.8);
  EXPECT_NEAR(TipHeight(plant, {kPi, 0, 0, 0}), 0.8, 1e-15);
  EXPECT_NEAR(TipHeight(plant, {kPi / 2, kPi / 2, 0, 0}), 0.3, 1e-15);
}

TEST(Inverted, IsWithinThirtyDegreesForBothLinksAndAnyTurns) {
  const double degree = kPi / 180;
  EXPECT_TRUE(Inverted({kPi, 0, 0, 0}));
  EXPECT_TRUE(Inverted({-kPi, 0, 0, 0}));
  EXPECT_TRUE(Inverted({3 * kPi, 2 * kPi, 0, 0}));
  EXPECT_TRUE(Inverted({kPi + 29.9 * degree, 0, 0, 0}));
  EXPECT_FALSE(Inverted({kPi + 30.1 * degree, 0, 0, 0}));
  // Link 2 counts by its absolute angle.
  EXPECT_TRUE(Inverted({kPi + 25 * degree, -50 * degree, 0, 0}));
  EXPECT_FALSE(Inverted({kPi + 25 * degree, 10 * degree, 0, 0}));
  EXPECT_FALSE(Inverted({kPi, kPi, 0, 0}));
  EXPECT_FALSE(Inverted({}));
}

TEST(Reward, TermsByHand) {
  const Plant plant;
  // Inverted at rest under 2 N·m: 1 + 1 + 5 - 0 - 0.05 · 4.
  const auto up = RewardTerms(plant, {kPi, 0, 0, 0}, 2);
  EXPECT_NEAR(up[0], 1, 1e-15);
  EXPECT_NEAR(up[1], 1, 1e-15);
  EXPECT_EQ(up[2], 5);
  EXPECT_EQ(up[3], 0);
  EXPECT_DOUBLE_EQ(up[4], -0.2);
  // Hanging under -5 N·m: 0 + 0 + 0 - 0 - 0.01 · 25.
  const auto down = RewardTerms(plant, {}, -5);
  EXPECT_DOUBLE_EQ(std::accumulate(down.begin(), down.end(), 0.0), -0.25);
  // Inverted and fast: the energy is clipped at 1.5, the velocities cost 0.01 (9² + 1²).
  const auto fast = RewardTerms(plant, {kPi, 0, 9, -1}, 0);
  EXPECT_EQ(fast[0], 1.5);
  EXPECT_DOUBLE_EQ(fast[3], -0.82);
  // Equally fast, but not inverted: no penalty on velocities.
  EXPECT_EQ(RewardTerms(plant, {0, 0, 9, -1}, 0)[3], 0);
}

TEST(Observe, ByHand) {
  const auto obs = Observe(Plant(), {kPi / 2, kPi / 6, 5, -10});
  const float expected[] = {0, 1, 0.5F, 0.8660254F, 0.5F, -0.5F};
  for (size_t i = 0; i < 6; ++i) EXPECT_NEAR(obs[i], expected[i], 1e-6);
  EXPECT_NEAR(obs[6], NormalizedEnergy(Plant(), {kPi / 2, kPi / 6, 5, -10}), 1e-6);
  EXPECT_NEAR(obs[7], 0.5 * std::sin(kPi / 6), 1e-6);  // link 1 is level, link 2 is 30° beyond it
}

TEST(Task, EnergyAndHeightFollowTheCurrentPlant) {
  Rng rng(2, "normalisers");
  for (int trial = 0; trial < 10; ++trial) {
    const Plant p = ModeratePlant(rng);
    const auto hanging = Observe(p, {});
    const auto inverted = Observe(p, {kPi, 0, 0, 0});
    EXPECT_NEAR(hanging[6], 0, 1e-6);
    EXPECT_NEAR(inverted[6], 1, 1e-6);
    EXPECT_NEAR(hanging[7], -1, 1e-6);
    EXPECT_NEAR(inverted[7], 1, 1e-6);
  }
}

}  // namespace
}  // namespace upswing
