#include "extras/realaigym/search.h"

#include <gtest/gtest.h>

#include <cmath>

#include "base/error.h"
#include "extras/realaigym/swing_net.h"

namespace upswing::realaigym {
namespace {

TEST(Snes, FindsTheBottomOfABowl) {
  // Axes with different scales, which the deviations must learn.
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
      ASSERT_NEAR(candidates[0][i] + candidates[1][i], 2 * snes.mean()[i], 1e-12);  // mirrored pair
    }
    std::vector<double> fitness;
    fitness.reserve(candidates.size());
    for (const auto& candidate : candidates) fitness.push_back(-cost(candidate));
    snes.Tell(fitness);
  }
  EXPECT_LT(cost(snes.mean()), 1e-10 * first);
  EXPECT_LT(snes.deviation()[5], snes.deviation()[0]);
}

BoardSearchConfig Small() {
  BoardSearchConfig config;
  config.hidden = 8;
  config.starts = 2;
  config.alone = 4;
  config.generations = 2;
  config.first_population = 16;
  config.population = 8;
  return config;
}

TEST(BoardSearch, ThreadsChangeNoBitAndItClimbs) {
  BoardSearch alone(Small()), together(Small());
  ThreadPool pool(3);
  BoardSearch::Report a, b;
  double first = 0;
  while (alone.Step(nullptr, a)) {
    ASSERT_TRUE(together.Step(&pool, b));
    if (a.generation == 1) first = a.best_fitness;
  }
  EXPECT_FALSE(together.Step(&pool, b));
  EXPECT_EQ(alone.generation(), 10);
  EXPECT_EQ(alone.numbers(), together.numbers());
  EXPECT_GT(a.best_fitness, first);
}

TEST(BoardSearch, OnATwinThePolicyMirrors) {
  BoardSearch search(Small());
  EXPECT_FALSE(search.net().mirrors());
  search.SearchOn(ReadTwin("realaigym-twin", "test"));
  EXPECT_TRUE(search.net().mirrors());
}

TEST(BoardSearch, TheBestStartGoesOn) {
  const auto run = [](int64_t seed, int64_t starts) {
    BoardSearchConfig config = Small();
    config.seed = seed;
    config.starts = starts;
    config.generations = 0;
    BoardSearch search(config);
    BoardSearch::Report report;
    while (search.Step(nullptr, report)) continue;
    return std::pair(report.best_fitness, search.numbers());
  };
  const auto first = run(1, 1), second = run(1 + 1'000'003, 1);  // the seed of run 1's second start
  ASSERT_NE(first.first, second.first);
  EXPECT_EQ(run(1, 2).second, std::max(first, second).second);
}

TEST(SwingNet, PoliciesSideBySideActLikeSinglePolicies) {
  for (const int hidden : {8, 16}) {
    const SwingNet net(Robot::kPendubot, hidden);
    const std::vector<double> a = net.Initial(1), b = net.Initial(2);
    const std::vector<BoardEpisode> episodes(kSwingGroup + 2);
    const auto cost = [&](const std::vector<std::span<const double>>& numbers, size_t lanes_each) {
      const auto outcomes = SimulateOnBoard(
          net.robot(), episodes, [&](size_t) { return net.Control(numbers, lanes_each); }, nullptr);
      std::vector<double> costs;
      costs.reserve(outcomes.size());
      for (const BoardOutcome& outcome : outcomes) costs.push_back(outcome.velocity_cost);
      return costs;
    };
    const double of_a = cost({a}, kBoardBlock)[0], of_b = cost({b}, kBoardBlock)[0];
    EXPECT_NE(of_a, of_b);
    const auto lanes = cost({a, b, a}, 1), groups = cost({a, b}, kSwingGroup);
    EXPECT_EQ(lanes[0], of_a);
    EXPECT_EQ(lanes[1], of_b);
    EXPECT_EQ(lanes[2], of_a);
    EXPECT_EQ(groups[kSwingGroup - 1], of_a);
    EXPECT_EQ(groups[kSwingGroup], of_b);
  }
}

TEST(SwingNet, ItIsReadAsItWasWritten) {
  const SwingNet net(Robot::kAcrobot, 12);
  const std::vector<double> numbers = net.Initial(5);
  const SwingPolicy read = ReadSwingPolicy(net.ToTensors(numbers));
  EXPECT_EQ(read.numbers, numbers);
  EXPECT_EQ(read.net.hidden(), 12);
  EXPECT_EQ(read.net.robot(), Robot::kAcrobot);
}

TEST(SwingNet, OtherFilesThanPoliciesAreRefused) {
  const SwingNet net(Robot::kPendubot, 8);
  const auto refuses = [&](const char* key, const std::string& value) {
    Tensors file = net.ToTensors(net.Initial(1));
    file.metadata[key] = value;
    EXPECT_THROW(ReadSwingPolicy(file), Error) << key;
  };
  for (const char* version : {"1", "4", "x"}) refuses("format_version", version);
  refuses("robot", "cartpole");
  for (const char* hidden : {"7", "2", "34", "-8", "1e9", "x", "10"}) refuses("hidden", hidden);
  std::vector<double> numbers = net.Initial(1);
  numbers[3] = std::nan("");
  EXPECT_THROW(ReadSwingPolicy(net.ToTensors(numbers)), Error);
  // Gains, rho and sharpness are exponents: e^1000 is not finite.
  for (const size_t i : {0, 4, 5}) {
    numbers = net.Initial(1);
    numbers[i] = -51;
    EXPECT_THROW(ReadSwingPolicy(net.ToTensors(numbers)), Error);
    numbers[i] = 50;
    EXPECT_NO_THROW(ReadSwingPolicy(net.ToTensors(numbers)));
  }
  EXPECT_FALSE(IsSwingPolicy(Tensors()));
}

}  // namespace
}  // namespace upswing::realaigym
