// Tests of identification in both engines. The estimator predicts with the closed form, not with
// MuJoCo.
#include "pendulum/identification.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <vector>

#include "mujoco/testing.h"
#include "pendulum/observation.h"
#include "pendulum/pendulum_env.h"

namespace upswing {
namespace {

class IdentifyingEnvs : public testing::TestWithParam<const Engine*> {
 protected:
  static PendulumEnvConfig Config() {
    PendulumEnvConfig config;
    config.engine = GetParam();
    config.num_envs = 3;
    config.episode_seconds = 0.1;  // five steps
    config.identified_from = Plant();
    return config;
  }
  static PendulumEnvConfig Box() {
    PendulumEnvConfig config = Config();
    config.num_envs = 64;
    config.episode_seconds = 10;
    for (size_t k = 0; k < 7; ++k) config.randomization.plant[k] = 0.25;
    return config;
  }
  /// Moves the pendulum with half-random torques for `seconds`, enough for identification.
  static void Excite(PendulumEnv& env, double seconds) {
    StepResult result = env.MakeResult();
    Rng rng(1, "test");
    std::vector<double> torque(static_cast<size_t>(env.spec().num_envs));
    for (int step = 0; step < seconds / kControlPeriod; ++step) {
      for (size_t i = 0; step % 5 == 0 && i < torque.size(); ++i) {
        const double along = env.state(static_cast<int>(i)).w1 > 0 ? 5 : -5;
        torque[i] = rng.Uniform() < 0.7 ? along : rng.Uniform(-5, 5);
      }
      env.Step(torque, result);
    }
  }
  /// Median and largest error of the observed δ and of the constants, over the plants.
  struct Errors {
    double median, largest;
  };
  static Errors Summary(std::vector<double> errors) {
    std::ranges::sort(errors);
    return {errors[errors.size() / 2], errors.back()};
  }
  static Errors DeltaErrors(const PendulumEnv& env) {
    std::vector<double> errors;
    for (int i = 0; i < env.spec().num_envs; ++i) {
      const Plant& plant = env.plant(i);
      const double delta = FallingOf(ManipulatorOf(plant), plant, {}).delta;
      errors.push_back(std::abs(env.obs()(i, kObservationSize + kConstants) - delta));
    }
    return Summary(errors);
  }
};

INSTANTIATE_TEST_SUITE_P(Physics, IdentifyingEnvs, EachEngine(), EngineName);

TEST_P(IdentifyingEnvs, FindThePlantOfEachEpisode) {
  PendulumEnv env(Box());
  EXPECT_GT(DeltaErrors(env).median, 0.05);  // estimate = nominal plant
  Excite(env, 1);
  EXPECT_LT(DeltaErrors(env).median, 0.01);
  Excite(env, 3);
  EXPECT_LT(DeltaErrors(env).median, 0.001);
  EXPECT_LT(DeltaErrors(env).largest, 0.02);
}

TEST_P(IdentifyingEnvs, NoiseMakesItLessExact) {
  PendulumEnvConfig config = Box();
  config.disturbances = {Disturbance{0.01, 0}};
  PendulumEnv env(config);
  Excite(env, 4);
  const Errors errors = DeltaErrors(env);
  EXPECT_LT(errors.median, 0.02);
  EXPECT_GT(errors.median, 0.001);
}

TEST_P(IdentifyingEnvs, KnowsItsSensors) {
  PendulumEnvConfig config = Box();
  config.disturbances = {{0, 0, {0.005, 4096, 0.01, 0}}};
  PendulumEnv env(config);
  Excite(env, 4);
  EXPECT_LT(DeltaErrors(env).median, 0.04);
}

TEST_P(IdentifyingEnvs, ObservationsHideThePlant) {
  PendulumEnvConfig config = Config(), other = Config();
  other.plants.front().mass2 = 1.2;
  other.plants.front().gravity = 8;
  PendulumEnv env(config), heavy(other);
  EXPECT_TRUE(std::ranges::equal(env.obs().values(), heavy.obs().values()));
  StepResult result = env.MakeResult();
  env.Step(std::vector<double>(3, 1.0), result);
  heavy.Step(std::vector<double>(3, 1.0), result);
  EXPECT_FALSE(std::ranges::equal(env.obs().values(), heavy.obs().values()));
}

TEST_P(IdentifyingEnvs, AnEpisodeBeginsWithoutKnowledge) {
  PendulumEnvConfig config = Config();
  config.plants.front().mass2 = 1.2;
  PendulumEnv env(config);
  StepResult result = env.MakeResult();
  for (int step = 1; step <= 5; ++step) {
    env.Step(std::vector<double>(3, 2.0), result);
    const auto constants = env.obs().row(0).subspan(kObservationSize, kConstants);
    const bool known = std::ranges::any_of(constants, [](float x) { return x != 0; });
    EXPECT_EQ(known, step < 5) << step;
  }
}

TEST_P(IdentifyingEnvs, MirroringKeepsTheEstimate) {
  PendulumEnvConfig config = Config();
  config.memory = 1;
  PendulumEnv env(config);
  StepResult result = env.MakeResult();
  env.SetState(0, {3, -0.2, 1, -2});
  env.SetState(1, {-3, 0.2, -1, 2});
  for (const double torque : {1.0, -3.0, 2.0}) env.Step(std::vector{torque, -torque, 0.0}, result);
  const std::vector<float> signs = env.spec().mirror_signs;
  ASSERT_EQ(static_cast<int>(signs.size()), kObservationSize + kIdentifiedSize + kMemorySize);
  ASSERT_EQ(static_cast<int>(signs.size()), env.spec().obs_size);
  for (size_t k = 0; k < signs.size(); ++k) {
    EXPECT_NEAR(env.obs().row(0)[k], signs[k] * env.obs().row(1)[k], 1e-5) << k;
  }
}

TEST_P(IdentifyingEnvs, LoadedStateContinuesWithTheSameBits) {
  PendulumEnvConfig config = Config();
  config.memory = 2;
  config.disturbances = {{0.01, 0.04, {0.01, 4096, 0.02, 0.02}}};
  ExpectLoadedGoesOn(config, 7);
}

}  // namespace
}  // namespace upswing
