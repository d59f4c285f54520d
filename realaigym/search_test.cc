#include "realaigym/search.h"

#include <gtest/gtest.h>

#include <cmath>

#include "core/error.h"

namespace upswing {
namespace {

TEST(Snes, FindsTheBottomOfABowl) {
  // Axes of different lengths, which the deviations learn.
  const auto cost = [](const std::vector<double>& x) {
    double sum = 0;
    for (size_t i = 0; i < x.size(); ++i) {
      sum += std::pow(10, static_cast<double>(i) / 2) * std::pow(x[i] - 1, 2);
    }
    return sum;
  };
  Snes snes(std::vector<double>(6, 0.0), std::vector<double>(6, 0.5), 1, 1);
  const double first = cost(snes.mean());
  for (int generation = 0; generation < 300; ++generation) {
    const auto& candidates = snes.Ask(20);
    for (size_t i = 0; i < 6; ++i) {
      ASSERT_NEAR(candidates[0][i] + candidates[1][i], 2 * snes.mean()[i], 1e-12);  // mirrored
    }
    std::vector<double> fitness;
    for (const auto& candidate : candidates) fitness.push_back(-cost(candidate));
    snes.Tell(fitness);
  }
  EXPECT_LT(cost(snes.mean()), 1e-10 * first);
  EXPECT_LT(snes.deviation()[5], snes.deviation()[0]);
}

GymSearchConfig Small() {
  GymSearchConfig config;
  config.hidden = 8;
  config.alone = 6;
  config.generations = 3;
  config.first_population = 64;
  config.population = 8;
  config.episodes = 12;
  config.interleaved = 1;
  return config;
}

TEST(GymSearch, ThreadsChangeNoBitAndItClimbs) {
  GymSearch alone(Small()), together(Small());
  ThreadPool pool(3);
  GymSearch::Report a, b;
  double first = 0;
  while (alone.Step(nullptr, a)) {
    ASSERT_TRUE(together.Step(&pool, b));
    if (a.generation == 1) first = a.best_fitness;
  }
  EXPECT_FALSE(together.Step(&pool, b));
  EXPECT_EQ(alone.generation(), 9);
  EXPECT_EQ(alone.numbers(), together.numbers());
  EXPECT_GT(a.best_fitness, first);
}

TEST(SwingNet, ALaneOfItsOwnActsAsABlockOfAll) {
  const SwingNet net(GymRobot::kPendubot, 8);
  const std::vector<double> a = net.Initial(1), b = net.Initial(2);
  const std::vector<GymEpisode> episodes(3);
  const auto run = [&](const std::vector<std::span<const double>>& numbers) {
    return SimulateGym(
        net.robot(), episodes, [&](size_t) { return net.Control(numbers); }, nullptr);
  };
  const auto of_a = run({a}), of_b = run({b}), mixed = run({a, b, a});
  EXPECT_EQ(mixed[0].velocity_cost, of_a[0].velocity_cost);
  EXPECT_EQ(mixed[1].velocity_cost, of_b[1].velocity_cost);
  EXPECT_EQ(mixed[2].velocity_cost, of_a[2].velocity_cost);
  EXPECT_NE(of_a[0].velocity_cost, of_b[0].velocity_cost);
}

TEST(SwingNet, ItIsReadAsItWasWritten) {
  const SwingNet net(GymRobot::kAcrobot, 12);
  const std::vector<double> numbers = net.Initial(5);
  const SwingPolicy read = ReadSwingPolicy(net.ToTensors(numbers));
  EXPECT_EQ(read.numbers, numbers);
  EXPECT_EQ(read.net.hidden(), 12);
  EXPECT_EQ(read.net.robot(), GymRobot::kAcrobot);
}

TEST(SwingNet, WhatIsNoPolicyIsRefused) {
  const SwingNet net(GymRobot::kPendubot, 8);
  const auto refuses = [&](const char* key, const std::string& value) {
    Tensors file = net.ToTensors(net.Initial(1));
    file.metadata[key] = value;
    EXPECT_THROW(ReadSwingPolicy(file), Error) << key;
  };
  refuses("format_version", "2");
  refuses("robot", "cartpole");
  for (const char* hidden : {"7", "2", "34", "-8", "1e9", "x", "10"}) refuses("hidden", hidden);
  std::vector<double> numbers = net.Initial(1);
  numbers[3] = std::nan("");
  EXPECT_THROW(ReadSwingPolicy(net.ToTensors(numbers)), Error);
  EXPECT_FALSE(IsSwingPolicy(Tensors()));
}

}  // namespace
}  // namespace upswing
