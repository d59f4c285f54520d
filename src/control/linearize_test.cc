#include "control/linearize.h"

#include <gtest/gtest.h>

#include <numbers>

#include "base/rng.h"
#include "control/testing.h"
#include "pendulum/closed_form.h"
#include "pendulum/upright_modes.h"

namespace upswing {
namespace {

/// The closed form's deviation after one control period from a deviation x and a torque.
Eigen::Vector4d AfterOnePeriod(const Plant& plant, const Eigen::Vector4d& x, double tau) {
  ClosedFormBatch batch(1);
  batch.SetPlant(0, plant);
  batch.SetState(0, {std::numbers::pi + x[0], x[1], x[2], x[3]});
  batch.tau[0] = tau;
  Advance(batch, kPhysicsSteps, 0, 1);
  return {batch.q1[0] - std::numbers::pi, batch.q2[0], batch.w1[0], batch.w2[0]};
}

LinearModel OverOnePeriod(const Plant& plant) {
  return Discretize(LinearizeUpright(plant), kPhysicsTimestep, kPhysicsSteps);
}

TEST(Linearize, IsTheJacobianOfTheClosedForm) {
  Rng rng(1, "plants");
  for (int trial = 0; trial < 200; ++trial) {
    Plant plant = DrawPlant(rng);
    plant.actuated_joint = rng.Uniform() < 0.5 ? 1 : 2;
    const LinearModel model = OverOnePeriod(plant);
    // Central differences: the error is of third order in e, plus rounding of 4e-16 over e.
    constexpr double e = 1e-5;
    for (int k = 0; k < 4; ++k) {
      const Eigen::Vector4d dx = e * Eigen::Vector4d::Unit(k);
      const Eigen::Vector4d column =
          (AfterOnePeriod(plant, dx, 0) - AfterOnePeriod(plant, -dx, 0)) / (2 * e);
      EXPECT_LT((column - model.A.col(k)).norm(), 1e-9) << "column " << k;
    }
    const Eigen::Vector4d none = Eigen::Vector4d::Zero();
    const Eigen::Vector4d column =
        (AfterOnePeriod(plant, none, e) - AfterOnePeriod(plant, none, -e)) / (2 * e);
    EXPECT_LT((column - model.B).norm(), 1e-9);
  }
}

TEST(Linearize, EqualsAnotherDerivationHeldExactly) {
  // testdata/make_riccati.py has the equations in absolute angles and the matrix exponential. Four
  // Runge-Kutta steps of 0.005 s omit (0.005 A)⁵/120 and higher terms.
  const RiccatiCase standard = SciPyCases().front();
  const LinearModel model = OverOnePeriod(Plant());
  EXPECT_NEAR((model.A - standard.model.A).cwiseAbs().maxCoeff(), 6.16e-8, 1e-10);
  EXPECT_NEAR((model.B - standard.model.B).cwiseAbs().maxCoeff(), 1.22e-8, 1e-10);
}

TEST(Linearize, ModesOfTheStandardPlant) {
  const UprightModes modes = ModesOf(Plant());
  EXPECT_NEAR(modes.faster, 4.97298, 1e-5);
  EXPECT_NEAR(modes.slower, 3.59606, 1e-5);
  EXPECT_NEAR(modes.delta, -0.40195, 1e-5);
}

/// The standard plant with its motor at `joint`. Bisection sets the damping of the other joint so
/// that delta is 0.
Plant UncontrollablePlant(int joint) {
  Plant plant;
  plant.actuated_joint = joint;
  double& damping = joint == 1 ? plant.damping2 : plant.damping1;
  double low = 0.1, high = 10;
  for (int i = 0; i < 60; ++i) {
    damping = (low + high) / 2;
    (ModesOf(plant).delta < 0 ? low : high) = damping;
  }
  return plant;
}

class Uncontrollable : public testing::TestWithParam<int> {};

TEST_P(Uncontrollable, WhereDeltaIsZeroTheTorqueMovesNothingOfOneMode) {
  const Plant plant = UncontrollablePlant(GetParam());
  const LinearModel model = LinearizeUpright(plant);
  // A left eigenvector of A for this mode; the torque has no part in it.
  const EigenSolver solver(model.A.transpose());
  const double pole = ModesOf(plant).pole;
  int found = 0;
  for (int k = 0; k < 4; ++k) {
    const double moved = std::abs(solver.eigenvectors().col(k).cwiseProduct(model.B).sum());
    if (std::abs(solver.eigenvalues()[k] - pole) > 1e-6) {
      EXPECT_GT(moved, 0.1);
      continue;
    }
    EXPECT_LT(moved, 1e-10);
    ++found;
  }
  EXPECT_EQ(found, 1);
}

INSTANTIATE_TEST_SUITE_P(MotorAtJoint, Uncontrollable, testing::Values(1, 2));

TEST(Linearize, DampingAtWhichTheStandardPlantCannotBeControlled) {
  EXPECT_NEAR(UncontrollablePlant(1).damping2, 0.38976969, 1e-8);
  // For the motor at joint 2: M11 z² + d1 z = G1 + G2 with z² = G2/M12.
  EXPECT_NEAR(UncontrollablePlant(2).damping1, 0.56598234, 1e-8);
}

}  // namespace
}  // namespace upswing
