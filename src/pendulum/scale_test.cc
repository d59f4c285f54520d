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
  for (double Plant::*I : {&Plant::inertia1, &Plant::inertia2, &Plant::armature, &Plant::armature1,
                           &Plant::rotor_inertia}) {
    image.*I *= inertia;
  }
  for (double Plant::*d : {&Plant::damping1, &Plant::damping2}) image.*d *= torque * time;
  for (double Plant::*f : {&Plant::coulomb1, &Plant::coulomb2}) image.*f *= torque;
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

TEST(Scale, ImagesOfNearSizesAreCarriedOver) {
  Rng rng(1, "test");
  for (int n = 0; n < 100; ++n) {
    Plant plant = n == 0 ? Plant() : OwnLinks(rng);
    if (n % 3 == 1) plant.rotor_inertia = 0.002 * plant.mass1;  // heavy ones
    if (n % 3 == 2) plant.coulomb2 = 0.1 * plant.mass2;
    for (const double length : {0.4, 0.6, 0.8, 0.95, 1.05, 1.2, 1.5, 2.0, 2.5}) {
      for (const double mass : {1.0, length, 1 / length, length * length * length}) {
        const double time = std::sqrt(length);
        Plant image = ImageOf(plant, length, mass, time);
        if (n == 0) image.armature = kArmature;  // capsules, with the default of a plant file
        const Scale ratio = CarryOver(plant, image);
        EXPECT_EQ(ratio, ScaleOf(image) / ScaleOf(plant)) << n << ": " << length << ", " << mass;
        EXPECT_NE(ratio, Scale());
      }
    }
    const Plant heavy = ImageOf(plant, 1, 2, 1);  // of another material
    EXPECT_NEAR(CarryOver(plant, heavy).torque, 2, 1e-9);
  }
}

/// RealAIGym's robots, of designs C.1 and A.0.
std::vector<Plant> Robots() {
  const Plant c1{.mass1 = 0.5235,
                 .mass2 = 0.6256,
                 .length1 = 0.2,
                 .length2 = 0.3,
                 .coulomb1 = 0.16,
                 .coulomb2 = 0.12,
                 .center1 = 0.2,
                 .center2 = 0.2557,
                 .inertia1 = 0.01095,
                 .inertia2 = 0.00997,
                 .armature = 0.00264};
  const Plant a0{.mass1 = 0.5594,
                 .mass2 = 0.6043,
                 .length1 = 0.3,
                 .length2 = 0.2,
                 .torque_limit = 6,
                 .coulomb1 = 0.093,
                 .coulomb2 = 0.078,
                 .center1 = 0.3,
                 .center2 = 0.1838,
                 .inertia1 = 0.00313,
                 .inertia2 = 0.00351,
                 .armature = 0.00322};
  return {c1, a0};
}

TEST(Scale, PlantsWithOneOtherValueKeepTheirUnits) {
  struct Slider {
    double Plant::*value;
    double low, high;
  };
  constexpr Slider kSliders[] = {// of the page
                                 {&Plant::mass1, 0.2, 3},       {&Plant::mass2, 0.2, 3},
                                 {&Plant::length1, 0.2, 1},     {&Plant::length2, 0.2, 1},
                                 {&Plant::damping1, 0, 1},      {&Plant::damping2, 0, 1},
                                 {&Plant::gravity, 1, 25},      {&Plant::torque_limit, 1, 10},
                                 {&Plant::armature, 1e-4, 0.1}, {&Plant::coulomb1, 0, 1}};
  for (const auto& [value, low, high] : kSliders) {
    for (int k = 0; k <= 100; ++k) {
      Plant plant;
      plant.*value = low + (high - low) * k / 100;
      EXPECT_EQ(CarryOver(Plant(), plant), Scale()) << plant.*value;
      EXPECT_EQ(CarryOver(plant, Plant()), Scale()) << plant.*value;
    }
  }
}

TEST(Scale, RobotsOfOneLaboratoryKeepTheirUnits) {
  Rng rng(1, "test");
  std::vector<Plant> plants = Robots();
  plants.emplace_back();
  for (const Plant& from : plants) {
    for (Plant plant : plants) {
      EXPECT_EQ(CarryOver(from, plant), Scale());
      // Identified or drawn again, with all values but the motor's up to 30% off.
      for (int n = 0; n < 100; ++n) {
        Plant other = plant;
        for (const PlantParameter& p : kPlantParameters) {
          if (p.value == &Plant::torque_limit || p.value == &Plant::actuated_joint) continue;
          other.*p.value *= std::exp(rng.Uniform(-0.3, 0.3));
        }
        EXPECT_EQ(CarryOver(from, other), Scale());
      }
    }
  }
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
