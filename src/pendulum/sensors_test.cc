#include "pendulum/sensors.h"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

#include "base/error.h"
#include "base/testing.h"
#include "pendulum/closed_form.h"

namespace upswing {
namespace {

constexpr double kTurn = 2 * std::numbers::pi;

/// Sensor output at the start of an episode, for joints that have always moved at these velocities.
PendulumState AtStart(const SensorModel& model, const PendulumState& start) {
  Sensors sensors(1, kControlPeriod, model);
  sensors.Begin(0, start);
  return sensors.Measure(0, model, start, 0);
}

TEST(SensorModel, SettingsAreChecked) {
  SensorModel model;
  const Options options = OptionsOf(model);
  EXPECT_THROW(options.Set("sensor_latency", "0.2", "test"), Error);
  EXPECT_THROW(options.Set("encoder_counts", "-1", "test"), Error);
  EXPECT_THROW(options.Set("velocity_window", "nan", "test"), Error);
  EXPECT_THROW(options.Set("velocity_filter", "-0.001", "test"), Error);
  EXPECT_TRUE(model.exact());
  for (const Option& option : options.all()) {
    SensorModel other;
    OptionsOf(other).Set(option.name, "0.01", "test");
    EXPECT_FALSE(other.exact()) << option.name;
  }
}

TEST(Encoder, AnglesAreRoundedToTheNearestCount) {
  EXPECT_EQ(Quantized(0.7, kTurn / 4), 0);
  EXPECT_EQ(Quantized(0.8, kTurn / 4), kTurn / 4);
  EXPECT_EQ(Quantized(-0.8, kTurn / 4), -kTurn / 4);
  EXPECT_EQ(Quantized(13.5, kTurn / 4), 9 * kTurn / 4);  // full turns are counted
  EXPECT_EQ(Quantized(0.7, 0), 0.7);
}

TEST(Sensors, VelocitiesAreDifferencesOfCounts) {
  // A count is 0.0628 rad. Joint 1 is at 0.985 rad 5 ms ago and at 0.955 rad 15 ms ago, counts 16
  // and 15. Joint 2 is at 0.205 and 0.215 rad, count 3 both times.
  constexpr double kCount = kTurn / 100;
  const PendulumState measured = AtStart({0.005, 100, 0.01, 0}, {1, 0.2, 3, -1});
  EXPECT_DOUBLE_EQ(measured.q1, 16 * kCount);
  EXPECT_DOUBLE_EQ(measured.q2, 3 * kCount);
  EXPECT_NEAR(measured.w1, kCount / 0.01, 1e-12);
  EXPECT_EQ(measured.w2, 0);
}

TEST(Sensors, WithoutAWindowTheEncoderLeavesTheVelocities) {
  const PendulumState measured = AtStart({0, 100, 0, 0}, {1, 0.2, 3, -1});
  EXPECT_DOUBLE_EQ(measured.q1, 16 * kTurn / 100);
  EXPECT_EQ(measured.w1, 3);
  EXPECT_EQ(measured.w2, -1);
}

TEST(Sensors, ZerosShiftTheAnglesBeforeTheyAreRounded) {
  constexpr double kCount = kTurn / 100;  // 0.0628 rad
  const SensorModel model{
      .encoder_counts = 100, .velocity_window = 0.01, .zero1 = 0.05, .zero2 = -0.3};
  const PendulumState measured = AtStart(model, {1, 0.2, 3, 0});
  EXPECT_DOUBLE_EQ(measured.q1, 17 * kCount);      // 1.05 rad
  EXPECT_DOUBLE_EQ(measured.q2, -2 * kCount);      // -0.1 rad
  EXPECT_NEAR(measured.w1, kCount / 0.01, 1e-10);  // 10 ms ago, at 1.02 rad, it is count 16
  EXPECT_EQ(measured.w2, 0);
}

TEST(Sensors, AnEpisodeBeginsInMotion) {
  const PendulumState start{1, -2, 3, -4};
  const PendulumState measured = AtStart({0.05, 0, 0.1, 0.03}, start);
  EXPECT_NEAR(measured.q1, 1 - 0.05 * 3, 1e-14);
  EXPECT_NEAR(measured.w1, 3, 1e-12);
  EXPECT_NEAR(measured.w2, -4, 1e-12);
}

TEST(Sensors, LatencyAndWindowReachBackToEarlierControlSteps) {
  const SensorModel model{0.02, 0, 0.04, 0};
  Sensors sensors(2, kControlPeriod, model);
  sensors.Begin(1, {});
  std::vector<double> q1{0, 0, 0};
  for (int step = 0; step < 8; ++step) {
    q1.push_back(std::sin(step));
    const PendulumState now{q1.back(), 0, std::cos(step), 0};
    const PendulumState measured = sensors.Measure(1, model, now, 0);
    const size_t k = q1.size() - 2;
    ASSERT_EQ(measured.q1, q1[k]);
    ASSERT_EQ(measured.w1, (q1[k] - q1[k - 2]) / 0.04);
    ASSERT_EQ(measured.q2, 0);
  }
}

TEST(Sensors, BetweenControlStepsTheyMeasureWhatThePhysicsDo) {
  // A violent motion: the cubic has an error of h⁴/384 times the fourth derivative.
  ClosedFormBatch batch(1);
  batch.SetState(0, {3, 0, 8, -15});
  std::array<SensorModel, kPhysicsSteps> models;
  for (int k = 0; k < kPhysicsSteps; ++k) models[k].latency = k * kPhysicsTimestep;
  Sensors sensors(kPhysicsSteps, kControlPeriod, models.back());
  for (int k = 0; k < kPhysicsSteps; ++k) sensors.Begin(k, batch.state(0));
  for (int step = 0; step < 100; ++step) {
    batch.SetTorque(std::array{step % 10 < 5 ? 5.0 : -5.0});
    std::array<PendulumState, kPhysicsSteps> before;  // the latest first
    for (int k = kPhysicsSteps - 1; k >= 0; --k) {
      Advance(batch, 1, 0, 1);
      before[k] = batch.state(0);
    }
    for (int k = 0; k < kPhysicsSteps; ++k) {
      const PendulumState measured = sensors.Measure(k, models[k], batch.state(0), 0);
      if (step == 0) continue;
      ASSERT_NEAR(measured.q1, before[k].q1, k == 0 ? 0 : 1e-4);
      ASSERT_NEAR(measured.q2, before[k].q2, k == 0 ? 0 : 1e-4);
      ASSERT_NEAR(measured.w2, before[k].w2, k == 0 ? 0 : 0.05);
    }
  }
}

TEST(Sensors, TheFilterAnswersAStepByTheClosedFormula) {
  // Joint 1 begins at rest; from the second control step on it moves at 2 rad/s.
  const SensorModel model{0, 0, 0, 0.05};
  Sensors sensors(1, kControlPeriod, model);
  sensors.Begin(0, {});
  EXPECT_EQ(sensors.Measure(0, model, {}, 0).w1, 0);
  const double y0 = sensors.Measure(0, model, {0.02, 0, 2, 0}, 0).w1;
  EXPECT_GT(y0, 0);
  for (int step = 1; step < 20; ++step) {
    const double t = step * kControlPeriod;
    const PendulumState measured = sensors.Measure(0, model, {0.02 + 2 * t, 0, 2, 0}, 0);
    ASSERT_NEAR(measured.w1, 2 + (y0 - 2) * std::exp(-t / 0.05), 1e-12);
    ASSERT_EQ(measured.w2, 0);
    ASSERT_EQ(measured.q1, 0.02 + 2 * t);  // only velocities pass the filter
  }
}

TEST(Sensors, ASlowerFilterLagsByItsTimeConstant) {
  // For a velocity ramp a·t, the low-pass lags by τ plus less than one update.
  const SensorModel model{0, 0, 0, 0.03};
  Sensors sensors(1, kControlPeriod, model);
  sensors.Begin(0, {});
  double w1 = 0;
  for (int step = 0; step < 100; ++step) {
    const double t = step * kControlPeriod;
    w1 = sensors.Measure(0, model, {t * t / 2, 0, t, 0}, 0).w1;
  }
  EXPECT_NEAR(w1, 99 * kControlPeriod - 0.03, kFilterPeriod);
}

TEST(Sensors, TheTorqueIsAsOldAsTheVelocities) {
  // The velocities are 5 + 10/2 + 15 ms old: a quarter of the control period before the last one.
  const SensorModel model{0.005, 0, 0.01, 0.015};
  EXPECT_DOUBLE_EQ(model.velocity_age(), 0.025);
  Sensors sensors(1, kControlPeriod, {0.005, 0, 0.02, 0.03});
  sensors.Begin(0, {});
  sensors.Measure(0, model, {}, 0);
  sensors.Measure(0, model, {}, 4);
  EXPECT_NEAR(sensors.Torque(0, model), 0, 1e-12);
  sensors.Measure(0, model, {}, 8);
  EXPECT_NEAR(sensors.Torque(0, model), 0.75 * 4, 1e-12);
  // The slowest filter that these sensors keep enough states for.
  EXPECT_NEAR(sensors.Torque(0, {0, 0, 0, 0.03}), 0.5 * 4, 1e-12);
}

TEST(Sensors, RoundingNoiseOfTheVelocities) {
  // Angles at random positions within their counts; joint 1 moves by 0 to 10 counts in the window.
  const SensorModel model{0, 1000, 0.01, 0};
  Sensors sensors(1, kControlPeriod, model);
  Rng rng(1, "test");
  constexpr int kCount = 20000;
  double square = 0;
  for (int n = 0; n < kCount; ++n) {
    double w[2];
    for (double& each : w) {
      const PendulumState start{rng.Uniform(0, 1), 0, rng.Uniform(0, kTurn), 0};
      sensors.Begin(0, start);
      each = sensors.Measure(0, model, start, 0).w1 - start.w1;
    }
    square += std::pow(w[1] - w[0], 2);
  }
  EXPECT_NEAR(std::sqrt(square / kCount), model.velocity_noise(), 0.02 * model.velocity_noise());
  EXPECT_EQ((SensorModel{0.01, 1000, 0, 0.01}).velocity_noise(), 0);
  EXPECT_EQ((SensorModel{0.01, 0, 0.01, 0.01}).velocity_noise(), 0);
}

TEST(Sensors, ExactSensorsNextToOthersMeasureTheSameBits) {
  const SensorModel slow{0.05, 4096, 0.03, 0.01};
  Sensors sensors(2, kControlPeriod, slow);
  sensors.Begin(0, {});
  sensors.Begin(1, {});
  for (int step = 0; step < 5; ++step) {
    const PendulumState now{0.1 * step, 1.0 / (step + 3), std::sin(step), std::cos(step)};
    const PendulumState measured = sensors.Measure(0, SensorModel(), now, step);
    EXPECT_EQ(measured.q1, now.q1);
    EXPECT_EQ(measured.q2, now.q2);
    EXPECT_EQ(measured.w1, now.w1);
    EXPECT_EQ(measured.w2, now.w2);
    EXPECT_EQ(sensors.Torque(0, SensorModel()), step);
  }
}

TEST(Sensors, LoadedOnesContinueWithTheSameBits) {
  const SensorModel model{0.005, 4096, 0.03, 0.01};
  Sensors saved(1, kControlPeriod, model), loaded(1, kControlPeriod, model);
  saved.Begin(0, {1, 2, 3, 4});
  for (int step = 0; step < 3; ++step) saved.Measure(0, model, {0.1 * step, 0, 5, 0}, step);
  SaveAndLoad([&](const Archive& archive) { saved.State(archive); },
              [&](const Archive& archive) { loaded.State(archive); });
  for (int step = 3; step < 6; ++step) {
    const PendulumState now{0.1 * step, 0, 5, 0};
    const PendulumState a = saved.Measure(0, model, now, step);
    const PendulumState b = loaded.Measure(0, model, now, step);
    EXPECT_EQ(a.q1, b.q1);
    EXPECT_EQ(a.w1, b.w1);
    EXPECT_EQ(saved.Torque(0, model), loaded.Torque(0, model));
  }
}

}  // namespace
}  // namespace upswing
