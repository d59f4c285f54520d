#include "pendulum/disturbance.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numbers>

#include "base/error.h"
#include "mujoco/testing.h"
#include "pendulum/pendulum_env.h"
#include "pendulum/stages.h"

namespace upswing {
namespace {

/// Four environments in closed form: perfect, with noise, with a delay, with both.
PendulumEnvConfig FourKinds() {
  PendulumEnvConfig config;
  config.engine = &kClosedForm;
  config.num_envs = 4;
  config.episode_seconds = 0.14;  // seven steps
  config.disturbances = {{0, 0}, {0.02, 0}, {0, 0.06}, {0.05, 0.02}};
  return config;
}

TEST(Disturbance, DelaysAreWholeControlPeriods) {
  EXPECT_EQ((Disturbance{0, 0}).delay_steps(kControlPeriod), 0);
  EXPECT_EQ((Disturbance{0, 0.02}).delay_steps(kControlPeriod), 1);
  EXPECT_EQ((Disturbance{0, 0.06}).delay_steps(kControlPeriod), 3);
  EXPECT_EQ((Disturbance{0, 1}).delay_steps(kControlPeriod), 50);
}

TEST(Disturbance, SettingsAreChecked) {
  Disturbance disturbance;
  const Options options = OptionsOf(disturbance);
  EXPECT_THROW(options.Set("delay", "-0.02", "test"), Error);
  EXPECT_THROW(options.Set("delay", "1.5", "test"), Error);
  EXPECT_THROW(options.Set("sensor_noise", "-1", "test"), Error);
  EXPECT_THROW(options.Set("sensor_noise", "nan", "test"), Error);
  EXPECT_FALSE(disturbance.any());
}

TEST(Disturbance, DelaysFollowTheControlPeriod) {
  const auto problem = [](double delay, double period) -> std::string {
    PendulumEnvConfig config;
    config.disturbances = {{0, delay}};
    config.control_period = period;
    try {
      PendulumEnv env(config);
    } catch (const Error& error) {
      return error.what();
    }
    return "";
  };
  EXPECT_EQ(problem(0.06, 0.02), "");
  EXPECT_EQ(problem(0.025, 0.005), "");
  EXPECT_EQ(
      problem(0.025, 0.02),
      "delay: expected a multiple of 0.02, the control period, got \"0.025\"; the nearest are "
      "0.02 and 0.04; sensor_latency may be any time up to 0.1 s");
  EXPECT_EQ(problem(0, 2), "control_period: expected 0.001 to 1 s, got 2");
}

TEST(DelayedMotors, TorquesArriveAfterTheDelayAndNoneFromAnEarlierEpisode) {
  DelayedMotors motors(3, kControlPeriod, 3);
  Episodes episodes;
  episodes.disturbances = {{0, 0}, {0, 0.02}, {0, 0.06}};
  episodes.steps = {0, 0, 0};
  StepResult result{EnvSpec()};
  // Torques that three motors apply when 1, 2, 3, … are chosen for all. The last two motors begin a
  // new episode before the step at which 5 is chosen.
  const double expected[7][3] = {{1, 0, 0}, {2, 1, 0}, {3, 2, 0}, {4, 3, 1},
                                 {5, 0, 0}, {6, 5, 0}, {7, 6, 0}};
  for (int k = 0; k < 7; ++k) {
    if (k == 4) {
      motors.Begin(1, episodes, {});
      motors.Begin(2, episodes, {});
      episodes.steps[1] = episodes.steps[2] = 0;
    }
    const std::vector<double> chosen(3, k + 1);
    ControlStep step{episodes, chosen, chosen, {nullptr, 3, 0}, result};
    motors.Act(step);
    for (size_t i = 0; i < 3; ++i) EXPECT_EQ(step.applied[i], expected[k][i]) << k << ", " << i;
    for (int64_t& count : episodes.steps) ++count;
  }
}

TEST(LateSteps, TheMotorsKeepTheTorqueBeforeForTheLateness) {
  constexpr int kSteps = 100000;
  PendulumEnvConfig config;
  config.num_envs = 2;
  config.control_period = 0.0075;
  config.disturbances = {{}, {.late_share = 0.05, .late = 0.0375}};
  LateSteps stage(config);
  Episodes episodes;
  episodes.disturbances = config.disturbances;
  StepResult result{EnvSpec()};
  // The torque chosen in step k is k, so that the applied torque tells how old it is.
  std::vector<int> of_age(20);
  for (int k = 0; k < kSteps; ++k) {
    const std::vector<double> chosen(2, k);
    ControlStep step{episodes, chosen, chosen, {nullptr, 2, 0}, result};
    stage.Act(step);
    ASSERT_EQ(step.applied[0], k);
    ++of_age.at(static_cast<size_t>(k - step.applied[1]));
  }
  // A torque is fresh with p = 0.95. A late step and its 0 to 4 followers are 3 steps on average.
  // The tolerance is more than five standard errors.
  const double steps_per_draw = 0.95 + 0.05 * 3;
  EXPECT_NEAR(of_age[0] / double{kSteps}, 0.95 / steps_per_draw, 0.01);
  EXPECT_NEAR(of_age[1] / double{kSteps}, 0.95 * 0.05 / steps_per_draw, 0.005);
  EXPECT_GT(of_age[5], 0.1 * of_age[1]);
}

TEST(LateSteps, AreRepeatableAndSavedWithARun) {
  PendulumEnvConfig config;
  config.engine = &kClosedForm;
  config.disturbances = {{.late_share = 0.3, .late = 0.1}};
  PendulumEnv env(config), other(config);
  StepResult result = env.MakeResult();
  const auto torques = [&](PendulumEnv& each) {
    std::vector<double> applied;
    for (int k = 0; k < 30; ++k) {
      each.Step(std::array{0.1 * k}, result);
      applied.push_back(result.torque[0]);
    }
    return applied;
  };
  const std::vector<double> first = torques(env);
  EXPECT_EQ(first, torques(other));
  PendulumEnv loaded(config);
  SaveAndLoad([&](const Archive& archive) { env.State(archive); },
              [&](const Archive& archive) { loaded.State(archive); });
  const std::vector<double> second = torques(env);
  EXPECT_NE(first, second);
  EXPECT_EQ(torques(loaded), second);
}

TEST(NoisySensors, NoiseIsNormalAndIndependentOnAllFour) {
  constexpr int kCount = 20000;
  NoisySensors sensors(1, kControlPeriod, {}, 1, "test");
  const PendulumState truth{1, 2, 3, 4};
  double sum[4] = {}, product[4][4] = {}, fourth[4] = {}, lag = 0, last = 0;
  for (int n = 0; n < kCount; ++n) {
    const PendulumState s = sensors.Measure(0, {0.3, 0}, truth, 0).state;
    const double z[4] = {(s.q1 - 1) / 0.3, (s.q2 - 2) / 0.3, (s.w1 - 3) / 0.3, (s.w2 - 4) / 0.3};
    for (int i = 0; i < 4; ++i) {
      sum[i] += z[i];
      fourth[i] += std::pow(z[i], 4);
      for (int j = 0; j < 4; ++j) product[i][j] += z[i] * z[j];
    }
    lag += z[0] * last;
    last = z[0];
  }
  // Tolerance: five standard errors, 1/√n for a mean or product, √(2/n) for the variance, √(96/n)
  // for z⁴.
  const double error = 5 / std::sqrt(kCount);
  for (int i = 0; i < 4; ++i) {
    EXPECT_NEAR(sum[i] / kCount, 0, error);
    EXPECT_NEAR(fourth[i] / kCount, 3, std::sqrt(96) * error);
    for (int j = 0; j < 4; ++j) {
      EXPECT_NEAR(product[i][j] / kCount, i == j ? 1 : 0, (i == j ? std::sqrt(2) : 1) * error);
    }
  }
  EXPECT_NEAR(lag / kCount, 0, error);
}

TEST(NoisySensors, EachEnvironmentHasItsOwnStream) {
  const Disturbance noisy{1, 0}, silent{0, 0};
  NoisySensors two(2, kControlPeriod, {}, 7, "test"), second(2, kControlPeriod, {}, 7, "test");
  NoisySensors other(1, kControlPeriod, {}, 7, "other"), first(1, kControlPeriod, {}, 7, "test");
  (void)two.Measure(0, noisy, {}, 0);  // leaves the second environment's stream unchanged
  (void)second.Measure(0, silent, {}, 0);
  const double noise = two.Measure(1, noisy, {}, 0).state.q1;
  EXPECT_EQ(noise, second.Measure(1, noisy, {}, 0).state.q1);
  EXPECT_NE(noise, other.Measure(0, noisy, {}, 0).state.q1);
  EXPECT_NE(noise, first.Measure(0, noisy, {}, 0).state.q1);
}

TEST(DisturbedEnv, OnlyMeasurementsHaveNoise) {
  PendulumEnvConfig config = FourKinds();
  config.disturbances = {{0, 0}, {0.02, 0}};
  config.num_envs = 2;
  PendulumEnv env(config);
  StepResult result = env.MakeResult();
  double largest = 0;
  for (int step = 0; step < 6; ++step) {
    // Both start in the same state under the same torque: the motion is the same, the measurements
    // differ.
    env.SetState(0, {0.3, 0.1, 0, 0});
    env.SetState(1, {0.3, 0.1, 0, 0});
    env.Step(std::vector<double>{2, 2}, result);
    EXPECT_EQ(env.state(0).w1, env.state(1).w1);
    EXPECT_EQ(result.reward[0], result.reward[1]);
    const auto seen = std::span(result.next_obs).subspan(kObservationSize, kObservationSize);
    // Sine and cosine are of the measured angle; height and energy are of the measured state.
    EXPECT_NEAR(std::hypot(seen[0], seen[1]), 1, 1e-6);
    const PendulumState said{std::atan2(seen[1], seen[0]), std::atan2(seen[4], seen[3]),
                             seen[2] * kMaxVelocity1, seen[5] * kMaxVelocity2};
    const auto expected = Observe(env.plant(1), said);
    for (size_t k = 0; k < kObservationSize; ++k) EXPECT_NEAR(seen[k], expected[k], 1e-6);
    largest = std::max(largest, std::abs(said.w1 - env.state(1).w1));
    // The next observation repeats the same measurement.
    EXPECT_TRUE(std::ranges::equal(env.obs().row(1), seen));
  }
  EXPECT_GT(largest, 0.005);
  EXPECT_LT(largest, 0.2);
}

TEST(DisturbedEnv, ADelayedMotorActsAsOneThatIsCommandedLater) {
  PendulumEnv env(FourKinds());
  PendulumEnvConfig perfect = FourKinds();
  perfect.disturbances = {Disturbance()};
  PendulumEnv reference(perfect);
  StepResult result = env.MakeResult(), expected = reference.MakeResult();
  for (int step = 0; step < 20; ++step) {  // past two resets
    const int in_episode = step % 7;
    const auto chosen = [&](int k) {
      return k < 0 ? 0.0 : 4 * std::sin(1.0 + step - in_episode + k);
    };
    env.Step(std::vector<double>(4, chosen(in_episode)), result);
    reference.Step(std::vector<double>{chosen(in_episode), chosen(in_episode),
                                       chosen(in_episode - 3), chosen(in_episode - 1)},
                   expected);
    EXPECT_EQ(result.reward, expected.reward);
    EXPECT_EQ(result.torque, expected.torque);
    EXPECT_EQ(result.truncated, expected.truncated);
    for (int i = 0; i < 4; ++i) EXPECT_EQ(env.state(i).q2, reference.state(i).q2);
    // Environments with perfect sensors observe the true state.
    for (const int i : {0, 2}) {
      EXPECT_TRUE(std::ranges::equal(env.obs().row(i), reference.obs().row(i),
                                     [](float a, float b) { return std::abs(a - b) < 1e-6; }));
    }
  }
}

TEST(DisturbedEnv, LoadedStateContinuesWithTheSameBits) {
  ExpectLoadedGoesOn(FourKinds(), 5);  // with delayed torques pending
}

/// Environments with different sensors, for each engine.
class MeasuredEnvs : public testing::TestWithParam<const Engine*> {
 protected:
  static PendulumEnvConfig Config() {
    PendulumEnvConfig config;
    config.engine = GetParam();
    config.num_envs = 3;
    config.episode_seconds = 0.14;  // seven steps
    config.disturbances = {{}, {0, 0, {0.02, 1000, 0.04, 0}}, {0.01, 0.02, {0.005, 0, 0.01, 0.02}}};
    return config;
  }
};

INSTANTIATE_TEST_SUITE_P(Physics, MeasuredEnvs, EachEngine(), EngineName);

TEST_P(MeasuredEnvs, ObservationsAreOfThePastCountsAndTheRestIsTrue) {
  PendulumEnv env(Config());
  PendulumEnvConfig perfect = Config();
  perfect.disturbances = {Disturbance()};
  PendulumEnv reference(perfect);
  StepResult result = env.MakeResult(), expected = reference.MakeResult();
  for (int episode = 0; episode < 3; ++episode) {
    const PendulumState start = env.state(1);
    std::vector<PendulumState> past;  // the start has index 3
    for (int k = -3; k <= 0; ++k) {
      const double t = k * kControlPeriod;
      past.push_back({start.q1 + t * start.w1, start.q2 + t * start.w2, start.w1, start.w2});
    }
    for (int step = 0; step < 7; ++step) {
      const PendulumState &then = past[past.size() - 2], &before = past[past.size() - 4];
      constexpr double kStep = 2 * std::numbers::pi / 1000;
      const double q1 = Quantized(then.q1, kStep), q2 = Quantized(then.q2, kStep);
      const auto seen = Observe(env.plant(1), {q1, q2, (q1 - Quantized(before.q1, kStep)) / 0.04,
                                               (q2 - Quantized(before.q2, kStep)) / 0.04});
      for (size_t k = 0; k < kObservationSize; ++k) ASSERT_NEAR(env.obs().row(1)[k], seen[k], 1e-6);
      const double torque = 4 * std::sin(step + episode);
      env.Step(std::vector<double>(3, torque), result);
      reference.Step(std::vector<double>(3, torque), expected);
      past.push_back(env.state(1));
      for (const size_t i : {0, 1}) ASSERT_EQ(result.reward[i], expected.reward[i]);
      ASSERT_TRUE(std::ranges::equal(env.obs().row(0), reference.obs().row(0),
                                     [](float a, float b) { return std::abs(a - b) < 1e-6; }));
    }
  }
}

TEST_P(MeasuredEnvs, LoadedStateContinuesWithTheSameBits) {
  PendulumEnvConfig config = Config();
  ExpectLoadedGoesOn(config, 5);
  config.randomization.sensor_latency = 0.05;
  config.randomization.plant.fill(0.2);
  ExpectLoadedGoesOn(config, 9);  // in the second episode
}

TEST(MeasuredEnv, BothPhysicsMeasureTheSame) {
  PendulumEnvConfig config;
  config.num_envs = 20;
  config.episode_seconds = 1;
  config.start.random_share = 0.5;
  config.disturbances = {{0, 0, {0.005, 4096, 0.01, 0.005}}};
  PendulumEnv twin(config);
  config.engine = &kMuJoCo;
  PendulumEnv mujoco(config);
  StepResult a = mujoco.MakeResult(), b = twin.MakeResult();
  for (int step = 0; step < 120; ++step) {  // past two resets
    const std::vector<double> torque(20, 5 * std::sin(0.3 * step));
    mujoco.Step(torque, a);
    twin.Step(torque, b);
    for (size_t k = 0; k < a.next_obs.size(); ++k) ASSERT_NEAR(a.next_obs[k], b.next_obs[k], 1e-6);
  }
}

}  // namespace
}  // namespace upswing
