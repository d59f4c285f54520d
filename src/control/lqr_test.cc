#include "control/lqr.h"

#include <gtest/gtest.h>

#include <Eigen/Core>
#include <cmath>
#include <limits>
#include <numbers>

#include "base/error.h"
#include "base/rng.h"
#include "control/linearize.h"
#include "control/riccati.h"
#include "control/testing.h"
#include "pendulum/closed_form.h"
#include "pendulum/observation.h"
#include "pendulum/testing.h"

namespace upswing {
namespace {

constexpr double kPi = std::numbers::pi;

using Deviation = std::array<double, 4>;  // x = [q1 - π, q2, w1, w2]

/// Simulates `periods` control periods from x under `torque(x)`, N·m. Returns the final deviation.
template <typename Torque>
Deviation Simulate(const Plant& plant, const Deviation& x, int periods, const Torque& torque) {
  ClosedFormBatch batch(1);
  batch.SetPlant(0, plant);
  batch.SetState(0, {kPi + x[0], x[1], x[2], x[3]});
  for (int period = 0; period < periods; ++period) {
    batch.tau[0] = torque(batch.state(0));
    Advance(batch, kPhysicsSteps, 0, 1);
  }
  return {batch.q1[0] - kPi, batch.q2[0], batch.w1[0], batch.w2[0]};
}

double Size(const Deviation& x) {
  return std::hypot(std::hypot(x[0], x[1]), std::hypot(x[2], x[3]));
}

/// The policy's torque in a state, N·m, through an observation, as an environment asks for it.
double TorqueOf(const LqrPolicy& policy, const Plant& plant, const PendulumState& state) {
  const auto obs = Observe(plant, state);
  double torque = std::numeric_limits<double>::quiet_NaN();
  const auto memory = policy.Start(1);
  policy.Act(Matrix<const float>(obs, 1, kObservationSize), Matrix<double>(&torque, 1, 1), *memory);
  return torque;
}

/// A random deviation of this size.
Deviation Draw(Rng& rng, double size) {
  Deviation x;
  for (double& number : x) number = rng.Normal();
  const double length = Size(x);
  for (double& number : x) number *= size / length;
  return x;
}

TEST(Lqr, HoldsThePendulumUpright) {
  const Plant plant;
  const LqrPolicy policy(LqrConfig(), plant);
  Rng rng(1, "starts");
  for (int trial = 0; trial < 300; ++trial) {
    // Small enough that the torque, about 125 N·m per radian, stays within its 5 N·m.
    const Deviation start = Draw(rng, 0.01);
    const auto torque = [&](const PendulumState& state) { return TorqueOf(policy, plant, state); };
    // The slowest mode shrinks by 0.933 per period, to 1e-15 in 10 s. Single-precision observations
    // leave some 1e-7.
    EXPECT_LT(Size(Simulate(plant, start, 500, torque)), 1e-5);
  }
}

TEST(Lqr, OtherGainsDoNotHoldIt) {
  const Plant plant;
  const Lqr lqr = SolveLqr(LqrConfig(), plant);
  const auto after = [&](double factor) {
    return Size(Simulate(plant, {1e-4, 0, 0, 0}, 250, [&](const PendulumState& s) {
      return factor * lqr.Torque({s.q1 - kPi, s.q2, s.w1, s.w2});
    }));
  };
  EXPECT_LT(after(1), 1e-8);
  EXPECT_GT(after(0), 0.01);
  EXPECT_GT(after(0.4), 0.01);
  EXPECT_FALSE(after(-1) < 0.01);  // a gain of the wrong sign: the result is not even finite
}

TEST(Lqr, TorqueByHand) {
  const Lqr lqr{{1, 2, 3, 4}, Eigen::Matrix4d::Zero()};
  EXPECT_EQ(lqr.Torque({0.5, -1, 2, 0.25}), -(0.5 - 2 + 6 + 1));
}

TEST(Lqr, SeesTheDeviationFromUpright) {
  const Plant plant;
  Rng rng(2, "states");
  for (int trial = 0; trial < 1000; ++trial) {
    const Deviation x{rng.Uniform(-3, 3), rng.Uniform(-3, 3), rng.Uniform(-9, 9),
                      rng.Uniform(-9, 9)};
    const double turns = 2 * kPi * (trial % 5 - 2);
    const auto seen =
        UprightDeviation(Observe(plant, {kPi + x[0] + turns, x[1] - turns, x[2], x[3]}));
    for (size_t k = 0; k < 4; ++k) EXPECT_NEAR(seen[k], x[k], 1e-6);
  }
}

TEST(Lqr, ActsByItsGainWithinTheLimit) {
  Plant plant;
  plant.torque_limit = 3;
  const LqrPolicy policy(LqrConfig(), plant);
  const Eigen::RowVector4d& K = policy.lqr().K;
  for (const Deviation& x : {Deviation{0.01, 0, 0, 0}, Deviation{0, -0.01, 0.02, 0},
                             Deviation{0.002, 0.003, -0.04, 0.05}}) {
    const double expected = -(K[0] * x[0] + K[1] * x[1] + K[2] * x[2] + K[3] * x[3]);
    ASSERT_LT(std::abs(expected), 3);
    const PendulumState state{kPi + x[0], x[1], x[2], x[3]};
    EXPECT_NEAR(TorqueOf(policy, plant, state), expected, 1e-4);
  }
  EXPECT_EQ(TorqueOf(policy, plant, {kPi + 1, 0, 0, 0}), 3);
  EXPECT_EQ(TorqueOf(policy, plant, {kPi - 1, 0, 0, 0}), -3);
}

TEST(Lqr, MirrorSymmetry) {
  const Plant plant;
  const LqrPolicy policy(LqrConfig(), plant);
  Rng rng(3, "states");
  for (int trial = 0; trial < 1000; ++trial) {
    const double scale = trial % 2 == 0 ? 0.01 : 4;  // within the limit, and mostly beyond it
    const PendulumState s{kPi + scale * rng.Uniform(-1, 1), scale * rng.Uniform(-1, 1),
                          scale * rng.Uniform(-1, 1), scale * rng.Uniform(-1, 1)};
    auto obs = Observe(plant, s);
    std::array<double, 2> torque;
    const auto memory = policy.Start(1);
    policy.Act(Matrix<const float>(obs, 1, kObservationSize), Matrix<double>(&torque[0], 1, 1),
               *memory);
    for (size_t k = 0; k < obs.size(); ++k) obs[k] *= kMirrorSigns[k];
    policy.Act(Matrix<const float>(obs, 1, kObservationSize), Matrix<double>(&torque[1], 1, 1),
               *memory);
    EXPECT_EQ(torque[0], -torque[1]);
  }
}

TEST(Lqr, ValueIsTheCostOfARollout) {
  LqrConfig config;
  config.q2 = 3;
  config.w1 = 0.5;
  config.torque = 2;
  const Lqr lqr = SolveLqr(config, Plant());
  const LinearModel model = Discretize(LinearizeUpright(Plant()), kPhysicsTimestep, kPhysicsSteps);
  Rng rng(4, "starts");
  for (int trial = 0; trial < 20; ++trial) {
    const Deviation start = Draw(rng, 1);
    double value = 0, cost = 0;
    for (size_t i = 0; i < 4; ++i) {
      for (size_t j = 0; j < 4; ++j)
        value +=
            start[i] * lqr.P(static_cast<Eigen::Index>(i), static_cast<Eigen::Index>(j)) * start[j];
    }
    Eigen::Vector4d x(start.data());
    for (int step = 0; step < 1000; ++step) {
      const double u = lqr.Torque({x[0], x[1], x[2], x[3]});
      cost += config.q1 * x[0] * x[0] + config.q2 * x[1] * x[1] + config.w1 * x[2] * x[2] +
              config.w2 * x[3] * x[3] + config.torque * u * u;
      x = model.A * x + model.B * u;
    }
    EXPECT_NEAR(cost, value, 1e-8 * value);
  }
}

TEST(Lqr, GainOfTheStandardPlant) {
  const Lqr lqr = SolveLqr(LqrConfig(), Plant());
  const RiccatiCase scipy = SciPyCases().front();  // exact hold instead of Runge-Kutta steps
  for (size_t i = 0; i < 4; ++i) {
    for (size_t j = 0; j < 4; ++j) {
      const double P = scipy.P(static_cast<Eigen::Index>(i), static_cast<Eigen::Index>(j));
      EXPECT_NEAR(lqr.P(static_cast<Eigen::Index>(i), static_cast<Eigen::Index>(j)), P,
                  1e-5 * std::abs(P));
    }
  }
  const std::array<double, 4> expected{-107.588, -107.944, -32.4837, -16.8763};
  for (size_t k = 0; k < 4; ++k)
    EXPECT_NEAR(lqr.K[static_cast<Eigen::Index>(k)], expected[k], 1e-3);
}

TEST(Lqr, DearTorqueAsksForLess) {
  LqrConfig cheap, dear;
  cheap.torque = 0.01;
  dear.torque = 100;
  EXPECT_GT(std::abs(SolveLqr(cheap, Plant()).K[0]), 1.2 * std::abs(SolveLqr(dear, Plant()).K[0]));
}

TEST(Lqr, InfoNamesTheDesignPlant) {
  Plant plant;
  plant.mass2 = 1.25;
  LqrConfig config;
  config.torque = 0.5;
  const LqrPolicy policy(config, plant);
  EXPECT_EQ(policy.kind(), "lqr");
  EXPECT_EQ(policy.description(),
            "linear-quadratic regulator about upright, weights 10, 10, 1, 1 and 0.5, gain -100.7, "
            "-100.9, -30.51, -16.05");
  EXPECT_EQ(policy.info().agent, "lqr");
  EXPECT_EQ(policy.info().task, kDoublePendulum);
  EXPECT_EQ(policy.info().plant.at("mass2"), 1.25);
  EXPECT_EQ(policy.info().control_period, kControlPeriod);
  EXPECT_NE(policy.info().config.find("lqr_torque = 0.5"), std::string::npos);
  EXPECT_EQ(policy.num_values(), 0);
  EXPECT_THROW(policy.ToTensors(), Error);
}

std::string MessageOf(const LqrConfig& config, const Plant& plant) {
  try {
    SolveLqr(config, plant);
  } catch (const Error& error) {
    return error.what();
  }
  return "";
}

TEST(Lqr, RefusesAPlantThatCannotBeHeld) {
  Plant plant;
  plant.damping2 = 0.38;
  EXPECT_EQ(MessageOf(LqrConfig(), plant), "");
  plant.damping2 = 0.38976969143555484;  // see linearize_test.cc
  const std::string message = MessageOf(LqrConfig(), plant);
  EXPECT_TRUE(
      message.starts_with("lqr: found no gain that holds this plant upright: its "
                          "unstable modes grow at 3.804/s and 3.389/s (ratio 0.8911), and "
                          "delta is "))
      << message;
  EXPECT_TRUE(
      message.ends_with("; where that is 0, damping of joint 2 cancels the coupling of the "
                        "links, and no torque reaches a mode"))
      << message;
}

TEST(Lqr, RefusesAPlantThatTheStepsCannotFollow) {
  Plant plant;
  plant.damping2 = 1e4;
  EXPECT_EQ(MessageOf(LqrConfig(), plant),
            "design plant: expected friction that stops the joints at a rate of at most 51200/s, "
            "because time steps of 1.95313e-05 s are too long beyond it, got 311065/s: damping2 = "
            "10000 N·m·s/rad and coulomb2 = 0 N·m act on 0.0321477 kg·m²");
}

TEST(Lqr, RefusesWeightsOfNothing) {
  LqrConfig config;
  config.q1 = config.q2 = config.w1 = config.w2 = 0;
  EXPECT_EQ(MessageOf(config, Plant()),
            "lqr: expected a weight above 0 for q1, q2, w1 or w2, got only 0");
  config.w2 = 1;
  EXPECT_EQ(MessageOf(config, Plant()), "");
}

TEST(Lqr, EveryPlantIsHeldOrRefused) {
  // The settings are drawn from their whole ranges.
  Rng rng(5, "plants");
  int held = 0;
  for (int trial = 0; trial < 2000; ++trial) {
    const Plant plant = RandomPlant(rng);
    if (!MessageOf(LqrConfig(), plant).empty()) continue;
    ++held;
    const LinearModel model = Discretize(LinearizeUpright(plant), kPhysicsTimestep, kPhysicsSteps);
    const Lqr lqr = SolveLqr(LqrConfig(), plant);
    const Eigen::RowVector4d& K = lqr.K;
    EXPECT_LT(SpectralRadius(model.A - model.B * K), 1);
  }
  EXPECT_GT(held, 1000);
}

}  // namespace
}  // namespace upswing
