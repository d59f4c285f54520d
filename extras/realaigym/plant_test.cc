#include "extras/realaigym/plant.h"

#include <gtest/gtest.h>

#include <array>
#include <cmath>

#include "base/rng.h"
#include "control/linearize.h"
#include "control/testing.h"
#include "pendulum/closed_form.h"
#include "runs/plant_file.h"

namespace upswing::realaigym {
namespace {

// Parameters of the benchmark's plant without friction (docs/howto/realaigym.md).

/// State q1, q2, w1, w2.
using BoardState = std::array<double, 4>;

/// Kinetic plus potential energy (J); the potential energy is 0 at the height of the pivot.
double EnergyOf(const Manipulator& plant, const BoardState& s) {
  return plant.At({s[0], s[1], s[2], s[3]}).energy + plant.G1 + plant.G2;
}

TEST(BoardPlant, AccelerationAndEnergyAreTheBenchmarks) {
  const Manipulator plant = ManipulatorOf(BoardPlant());
  const auto [a1, a2] = plant.Acceleration({1, 0.5, 0.3, -0.7}, {2, 0});
  EXPECT_NEAR(a1, 23.421661493, 1e-9);
  EXPECT_NEAR(a2, -67.143867013, 1e-9);
  EXPECT_NEAR(EnergyOf(plant, {1, 0.5, 0.3, -0.7}), -1.3257887730, 1e-10);
}

TEST(BoardPlant, IsTheShippedPlant) {
  const Plant plant = ReadPlantFile("realaigym").plant;
  EXPECT_EQ(plant.torque_limit, kBoardTorqueLimit);
  EXPECT_EQ(plant.gear_ratio, kBoardGearRatio);
  const Manipulator shipped = ManipulatorOf(plant), board = ManipulatorOf(BoardPlant());
  // The inertia about the joint is a sum, whose rounding is about 1e-17.
  EXPECT_NEAR(shipped.J1, board.J1, 1e-16);
  EXPECT_NEAR(shipped.J2, board.J2, 1e-16);
  for (double Manipulator::*constant :
       {&Manipulator::b, &Manipulator::a, &Manipulator::G1, &Manipulator::G2, &Manipulator::d1,
        &Manipulator::d2, &Manipulator::f1, &Manipulator::f2}) {
    EXPECT_NEAR(shipped.*constant, board.*constant, 1e-15);
  }
}

/// The state `seconds` after (1, 0.5, 0, 0) under a constant torque.
BoardState After(double seconds, double torque) {
  ClosedFormBatch batch(1);
  batch.SetManipulator(0, ManipulatorOf(BoardPlant()));
  batch.SetState(0, {1, 0.5, 0, 0});
  batch.tau[0] = torque;
  Advance(batch, static_cast<int>(std::lround(seconds / kBoardTimestep)), 0, 1, kBoardTimestep);
  return {batch.q1[0], batch.q2[0], batch.w1[0], batch.w2[0]};
}

void ExpectState(const BoardState& got, const BoardState& expected) {
  for (size_t k = 0; k < 4; ++k) EXPECT_NEAR(got[k], expected[k], 2e-8) << k;
}

TEST(BoardPlant, MotionsAreTheBenchmarks) {
  ExpectState(After(0.5, 0), {-0.434944568, -0.428248473, -4.784121124, 0.441863385});
  ExpectState(After(1, 0), {-0.341916511, -0.434082669, 4.645649569, 0.330197003});
  const BoardState end = After(2, 0);
  ExpectState(end, {-0.529998365, -0.408895796, -4.793176912, 1.031446267});
  EXPECT_NEAR(EnergyOf(ManipulatorOf(BoardPlant()), end), -1.32905037, 1e-8);
  ExpectState(After(1, 1), {0.692529048, -1.140444454, 3.70580572, 2.034784789});
  ExpectState(After(2, 1), {-0.477500598, -0.10842366, -4.904724458, 6.464643867});
}

TEST(BoardPlant, LinearModelAndRegulatorAreTheBenchmarks) {
  const LinearModel model = LinearizeUpright(ManipulatorOf(BoardPlant()), 1);
  const Eigen::Matrix2d gravity = model.A.bottomLeftCorner<2, 2>();
  EXPECT_NEAR(gravity(0, 0), 34.45333863, 1e-8);
  EXPECT_NEAR(gravity(0, 1), -26.820907594, 1e-8);
  EXPECT_NEAR(gravity(1, 0), -25.273895165, 1e-8);
  EXPECT_NEAR(gravity(1, 1), 74.534058517, 1e-8);
  EXPECT_NEAR(model.B[2], 27.179932885, 1e-8);
  EXPECT_NEAR(model.B[3], -44.272653678, 1e-8);
  const Eigen::RowVector4d K =
      ContinuousLqr(model, Eigen::Vector4d(0.97, 0.93, 0.39, 0.26).asDiagonal(), 0.11).K;
  const Eigen::RowVector4d expected{-74.06251872, -71.588802601, -17.239516925, -12.792756538};
  EXPECT_LT((K - expected).cwiseAbs().maxCoeff(), 1e-7);
}

TEST(BoardPlant, LinearModelIsTheDerivativeOfTheMotion) {
  BoardPlant numbers;
  numbers.rotor_inertia = 6e-5;
  numbers.damping1 = 0.03;
  numbers.damping2 = -0.02;
  const Manipulator plant = ManipulatorOf(numbers);
  for (const int joint : {1, 2}) {
    const LinearModel model = LinearizeUpright(plant, joint);
    const auto acceleration = [&](const Eigen::Vector4d& x, double u) {
      const auto [a1, a2] = plant.Acceleration({std::acos(-1.0) + x[0], x[1], x[2], x[3]},
                                               {joint == 1 ? u : 0, joint == 2 ? u : 0});
      return Eigen::Vector2d(a1, a2);
    };
    constexpr double h = 1e-6;
    for (Eigen::Index k = 0; k < 4; ++k) {
      const Eigen::Vector4d step = h * Eigen::Vector4d::Unit(k);
      const Eigen::Vector2d slope = (acceleration(step, 0) - acceleration(-step, 0)) / (2 * h);
      EXPECT_LT((slope - model.A.col(k).tail<2>()).norm(), 1e-6) << k;
    }
    const Eigen::Vector4d none = Eigen::Vector4d::Zero();
    const Eigen::Vector2d slope = (acceleration(none, h) - acceleration(none, -h)) / (2 * h);
    EXPECT_LT((slope - model.B.tail<2>()).norm(), 1e-6);
  }
}

TEST(BoardPlant, FrictionIsThatOfTheFormula) {
  // Compares with the equations with rotors and friction, solved directly.
  Rng rng(1, "states");
  BoardPlant p;
  p.rotor_inertia = 8e-5;
  p.damping1 = 0.05;
  p.damping2 = -0.08;
  p.friction1 = 0.15;
  p.friction2 = -0.12;
  for (int trial = 0; trial < 100; ++trial) {
    const PendulumState s{rng.Uniform(-3, 3), rng.Uniform(-3, 3), rng.Uniform(-9, 9),
                          rng.Uniform(-9, 9)};
    const auto& [q1, q2, w1, w2] = s;
    const auto [a1, a2] = ManipulatorOf(p).Acceleration(s, {0, 0});
    const double gear = 6, J = p.rotor_inertia, c2 = std::cos(q2);
    const double h = p.mass2 * p.length1 * p.center2;
    Eigen::Matrix2d M;
    M(0, 0) = p.inertia1 + p.inertia2 + p.mass2 * p.length1 * p.length1 + 2 * h * c2 +
              (gear * gear + 1) * J;
    M(0, 1) = M(1, 0) = p.inertia2 + h * c2 - gear * J;
    M(1, 1) = p.inertia2 + gear * gear * J;
    const double g2 = 9.81 * p.mass2 * p.center2 * std::sin(q1 + q2);
    const double g1 = 9.81 * (p.mass1 * p.center1 + p.mass2 * p.length1) * std::sin(q1) + g2;
    const Eigen::Vector2d f(
        h * std::sin(q2) * (2 * w1 * w2 + w2 * w2) - g1 - 0.05 * w1 - 0.15 * std::atan(100 * w1),
        -h * std::sin(q2) * w1 * w1 - g2 + 0.08 * w2 + 0.12 * std::atan(100 * w2));
    const Eigen::Vector2d rest = M * Eigen::Vector2d(a1, a2) - f;
    EXPECT_LT(rest.norm(), 1e-12 * (1 + f.norm()));
  }
}

}  // namespace
}  // namespace upswing::realaigym
