#include "pendulum/scale.h"

#include <gtest/gtest.h>

#include <cmath>

#include "pendulum/pendulum_env.h"
#include "pendulum/testing.h"

namespace upswing {
namespace {

/// The image of a plant with its own links: length × `length`, mass × `mass`, time × `time`.
Plant ImageOf(const Plant& plant, double length, double mass, double time) {
  const double inertia = mass * length * length, torque = inertia / (time * time);
  Plant image = plant;
  for (double Plant::*m : {&Plant::mass1, &Plant::mass2}) image.*m *= mass;
  for (double Plant::*l : {&Plant::length1, &Plant::length2, &Plant::center1, &Plant::center2}) {
    image.*l *= length;
  }
  for (double Plant::*I :
       {&Plant::inertia1, &Plant::inertia2, &Plant::armature, &Plant::rotor_inertia}) {
    image.*I *= inertia;
  }
  for (double Plant::*d : {&Plant::damping1, &Plant::damping2}) image.*d *= torque * time;
  image.gravity *= length / (time * time);
  image.torque_limit *= torque;
  return image;
}

/// A random plant with its own links and no dry friction, whose slope is no natural unit.
Plant OwnLinks(Rng& rng) {
  Plant plant;
  plant.mass1 = std::exp(rng.Uniform(-1, 1));
  plant.mass2 = std::exp(rng.Uniform(-1, 1));
  plant.length1 = std::exp(rng.Uniform(-1, 0));
  plant.length2 = std::exp(rng.Uniform(-1, 0));
  plant.center1 = plant.length1 * rng.Uniform(0.3, 0.9);
  plant.center2 = plant.length2 * rng.Uniform(0.3, 0.9);
  plant.inertia1 = plant.mass1 * plant.length1 * plant.length1 * rng.Uniform(0.05, 0.2);
  plant.inertia2 = plant.mass2 * plant.length2 * plant.length2 * rng.Uniform(0.05, 0.2);
  plant.damping1 = rng.Uniform(0, 0.3);
  plant.damping2 = rng.Uniform(0, 0.3);
  plant.actuated_joint = rng.Uniform() < 0.5 ? 1 : 2;
  return plant;
}

TEST(Scale, TheBuiltInPlantHasUnits1) {
  EXPECT_EQ(ScaleOf(Plant()), Scale());
  EXPECT_EQ(TaskScaleOf(Plant()), Scale());
}

TEST(Scale, AnImageHasTheUnitsOfTheImage) {
  Rng rng(1, "test");
  for (int n = 0; n < 100; ++n) {
    const Plant plant = OwnLinks(rng);
    const double length = std::exp(rng.Uniform(-3, 3)), mass = std::exp(rng.Uniform(-4, 4));
    const double time = std::exp(rng.Uniform(-2, 2));
    const Scale ratio = ScaleOf(ImageOf(plant, length, mass, time)) / ScaleOf(plant);
    EXPECT_NEAR(ratio.time / time, 1, 1e-12);
    EXPECT_NEAR(ratio.torque / (mass * length * length / (time * time)), 1, 1e-12);
  }
}

TEST(Scale, OnlyPlantsOfAnotherSizeAreCarriedOver) {
  Plant heavier;
  heavier.mass2 = 1.5;
  EXPECT_EQ(CarryOver(Plant(), heavier), Scale());
  Rng rng(1, "test");
  const Plant plant = OwnLinks(rng), image = ImageOf(plant, 0.1, 1e-3, std::sqrt(0.1));
  EXPECT_NEAR(CarryOver(plant, image).time, std::sqrt(0.1), 1e-12);
  EXPECT_NEAR(CarryOver(plant, image).torque, 1e-4, 1e-16);
  EXPECT_EQ(CarryOver(image, image), Scale());
}

/// Steps `env` under the torques sin(k), in units of its limit, and returns all observations,
/// rewards and states, the latter in natural units.
std::vector<double> History(PendulumEnv& env, double time) {
  StepResult result(env.spec());
  std::vector<double> history;
  for (int k = 0; k < 150; ++k) {
    const double torque = env.plant(0).torque_limit * std::sin(k / 5.0);
    env.Step({&torque, 1}, result);
    for (const float x : result.next_obs) history.push_back(x);
    history.push_back(result.reward[0]);
    const PendulumState s = env.state(0);
    for (const double x : {s.q1, s.q2, s.w1 * time, s.w2 * time}) history.push_back(x);
  }
  return history;
}

TEST(Scale, EpisodesOfAPlantAndItsImageAreTheSame) {
  Rng rng(1, "test");
  for (int n = 0; n < 100; ++n) {
    const Plant plant = OwnLinks(rng);
    for (const double length : {0.02, 0.1, 0.3, 3.0, 10.0}) {
      const double mass = std::exp(rng.Uniform(-3, 3)), time = std::sqrt(length);
      PendulumEnvConfig config;
      config.plants = {plant};
      config.memory = 2;
      config.start.random_share = 1;
      config.identified_from = plant;
      PendulumEnvConfig image = config;
      image.plants = {ImageOf(plant, length, mass, time)};
      image.scale = ScaleOf(image.plant(0)) / ScaleOf(plant);
      image.identified_from = image.plant(0);
      image.control_period *= time;
      image.episode_seconds *= time;
      image.start.random_velocity /= time;
      if (image.control_period < kShortestPeriod) continue;
      PendulumEnv one(config), other(image);
      const std::vector<double> expected = History(one, 1), got = History(other, time);
      for (size_t i = 0; i < expected.size(); ++i) {
        // Rounding grows in a chaotic swing.
        ASSERT_NEAR(got[i], expected[i], 1e-6 * (1 + std::abs(expected[i])))
            << "plant " << n << ", length " << length << ", number " << i;
      }
    }
  }
}

}  // namespace
}  // namespace upswing
