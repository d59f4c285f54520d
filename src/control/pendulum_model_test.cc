#include "control/pendulum_model.h"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>
#include <vector>

#include "base/rng.h"
#include "control/testing.h"

namespace upswing {
namespace {

StateVector DrawState(Rng& rng) {
  return {rng.Uniform(-4, 4), rng.Uniform(-4, 4), rng.Uniform(-8, 8), rng.Uniform(-12, 12)};
}

/// ẋ from the equations of motion.
StateVector Derivative(const Manipulator& plant, const StateVector& x, double u) {
  const auto a = plant.Acceleration(StateOf(x), {u, 0});
  return {x[2], x[3], a[0], a[1]};
}

/// One control period, by textbook Runge-Kutta steps.
StateVector Stepped(const Manipulator& plant, StateVector x, double u) {
  for (int step = 0; step < kPhysicsSteps; ++step) {
    constexpr double h = kPhysicsTimestep;
    const StateVector k1 = Derivative(plant, x, u), k2 = Derivative(plant, x + h / 2 * k1, u),
                      k3 = Derivative(plant, x + h / 2 * k2, u),
                      k4 = Derivative(plant, x + h * k3, u);
    x += h / 6 * (k1 + 2 * k2 + 2 * k3 + k4);
  }
  return x;
}

TEST(PendulumModel, StepsAsTheEquationsOfMotionSay) {
  Rng rng(1, "plants");
  for (int trial = 0; trial < 50; ++trial) {
    const Plant plant = DrawPlant(rng);
    PendulumModel model(plant);
    std::vector<StateVector> x;
    std::vector<double> u;
    for (int i = 0; i < 7; ++i) {
      x.push_back(DrawState(rng));
      u.push_back(rng.Uniform(-20, 20));  // the model ignores the torque limit
    }
    std::vector<StateVector> after = x;
    model.Step(after, u);
    for (size_t i = 0; i < x.size(); ++i) {
      const StateVector expected = Stepped(ManipulatorOf(plant), x[i], u[i]);
      EXPECT_LT((after[i] - expected).norm(), 1e-11 * (1 + expected.norm()));
    }
  }
}

TEST(PendulumModel, DerivativesMatchTheSteps) {
  Rng rng(2, "states");
  const Plant plant = DrawPlant(rng);
  const Manipulator manipulator = ManipulatorOf(plant);
  PendulumModel model(plant);
  std::vector<StateVector> x;
  std::vector<double> u;
  for (int i = 0; i < 30; ++i) {
    x.push_back(DrawState(rng));
    u.push_back(rng.Uniform(-5, 5));
  }
  std::vector<LinearModel> models(x.size());
  model.Linearize(x, u, models);
  // Fourth-order differences with another step: (8 (f(e) - f(-e)) - (f(2e) - f(-2e))) / 12e.
  constexpr double e = 1e-3;
  for (size_t i = 0; i < x.size(); ++i) {
    const auto derivative = [&](const StateVector& dx, double du) -> StateVector {
      const auto f = [&](double s) { return Stepped(manipulator, x[i] + s * dx, u[i] + s * du); };
      return (8 * (f(e) - f(-e)) - (f(2 * e) - f(-2 * e))) / (12 * e);
    };
    for (int k = 0; k < 4; ++k) {
      EXPECT_LT((models[i].A.col(k) - derivative(StateVector::Unit(k), 0)).norm(), 1e-8);
    }
    EXPECT_LT((models[i].B - derivative(StateVector::Zero(), 1)).norm(), 1e-8);
  }
}

TEST(PendulumModel, UprightItIsTheLinearModel) {
  const Plant plant;
  const std::vector<StateVector> x{{std::numbers::pi, 0, 0, 0}};
  const std::vector<double> u{0};
  std::vector<LinearModel> models(1);
  PendulumModel(plant).Linearize(x, u, models);
  const LinearModel expected = Discretize(LinearizeUpright(plant), kPhysicsTimestep, kPhysicsSteps);
  EXPECT_LT((models[0].A - expected.A).norm(), 1e-8);
  EXPECT_LT((models[0].B - expected.B).norm(), 1e-8);
}

TEST(PendulumModel, PlansTakeFewStepsWhereTheyFollowTheSimulation) {
  const DesignPlant usual;
  EXPECT_LT(PlanningSteps(usual), usual.physics_steps());
  DesignPlant rough;
  rough.coulomb1 = rough.coulomb2 = 0.05;  // N·m, an arctangent that is steep at rest
  EXPECT_GT(PlanningSteps(rough), PlanningSteps(usual));

  // The error is as promised at states that the choice did not see.
  Rng rng(4, "states");
  std::vector<StateVector> x;
  std::vector<double> u;
  for (int i = 0; i < 200; ++i) {
    x.push_back(DrawState(rng));
    u.push_back(rng.Uniform(-5, 5));
  }
  std::vector<StateVector> planned = x;
  PendulumModel(usual).Step(x, u);
  PendulumModel(usual, PlanningSteps(usual)).Step(planned, u);
  double squares = 0;
  for (size_t i = 0; i < x.size(); ++i) squares += (planned[i] - x[i]).squaredNorm();
  EXPECT_LT(std::sqrt(squares / 200), 3e-3);
}

TEST(Manipulator, EnergyChangesOnlyByWorkAndDamping) {
  Rng rng(3, "states");
  for (int trial = 0; trial < 100; ++trial) {
    const Plant plant = DrawPlant(rng);
    const Manipulator manipulator = ManipulatorOf(plant);
    const StateVector x = DrawState(rng);
    const double u = rng.Uniform(-5, 5);
    constexpr double e = 1e-5;
    const StateVector rate = Derivative(manipulator, x, u);
    const double change = (manipulator.At(StateOf(x + e * rate)).energy -
                           manipulator.At(StateOf(x - e * rate)).energy) /
                          (2 * e);
    const double power = u * x[2] - plant.damping1 * x[2] * x[2] - plant.damping2 * x[3] * x[3];
    EXPECT_NEAR(change, power, 1e-6 * (1 + std::abs(power)) + 1e-5);
  }
  EXPECT_NEAR(ManipulatorOf(Plant()).At({std::numbers::pi, 0, 0, 0}).energy, 0, 1e-12);
}

}  // namespace
}  // namespace upswing
