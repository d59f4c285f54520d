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

TEST(Pose, IsARestThatMovesNothing) {
  for (const Pose& pose : kPoses) {
    const PendulumState rest = RestIn(pose), seen = SeenFrom(pose, rest);
    EXPECT_TRUE(Inverted(seen)) << PoseName(pose);
    EXPECT_NEAR(std::cos(rest.q1), pose.up1 ? -1 : 1, 1e-15);
    EXPECT_NEAR(std::cos(rest.q1 + rest.q2), pose.up2 ? -1 : 1, 1e-15);
    EXPECT_NEAR(std::sin(rest.q1) + std::sin(rest.q1 + rest.q2), 0, 1e-15);  // no gravity torque
    for (const Pose& other : kPoses) {
      EXPECT_EQ(Inverted(SeenFrom(other, rest)), other == pose) << PoseName(other);
    }
  }
  EXPECT_EQ(PoseName({true, false}), "up-down");
}

TEST(Reward, OfAGoalByHand) {
  const Plant plant;  // links of equal mass and length: at rest Ê is 1, 3/4, 1/4, 0
  const double energy[] = {1, 0.75, 0.25, 0};
  for (size_t i = 0; i < kPoses.size(); ++i) {
    for (size_t k = 0; k < kPoses.size(); ++k) {
      const auto terms = RewardTerms(plant, RestIn(kPoses[i]), 2, kPoses[k]);
      EXPECT_NEAR(terms[0], 1 - std::abs(energy[i] - energy[k]), 1e-15);
      EXPECT_EQ(terms[2], i == k ? 5 : 0);
      EXPECT_EQ(terms[4], (i == k ? -0.05 : -0.01) * 4);
    }
  }
  // Link 1 points at the goal, link 2 away from it: half of the height.
  EXPECT_NEAR(RewardTerms(plant, RestIn({true, true}), 0, {true, false})[1], 0.5, 1e-15);
  EXPECT_NEAR(RewardTerms(plant, RestIn({false, true}), 0, {false, true})[1], 1, 1e-15);
  // Hanging and much too fast for it: no energy term, and the velocities cost 0.01 (12² + 1²).
  const auto fast = RewardTerms(plant, {0, 0, 12, -1}, 0, {false, false});
  EXPECT_EQ(fast[0], 0);
  EXPECT_DOUBLE_EQ(fast[3], -1.45);
  // Upright, the built-in reward differs only in the energy beyond that of the goal.
  const PendulumState slow{kPi - 0.1, 0.1, 0.1, -0.2};
  const auto built_in = RewardTerms(plant, slow, 1), own = RewardTerms(plant, slow, 1, Pose());
  for (size_t k = 0; k < built_in.size(); ++k) EXPECT_NEAR(built_in[k], own[k], 1e-15);
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
