#include "control/best_episode.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <vector>

namespace upswing {
namespace {

const TorqueTable kAny, kNine{-5, -3.75, -2.5, -1.25, 0, 1.25, 2.5, 3.75, 5};

BestEpisodeSearch Search() { return {Plant(), 6, {}}; }

BestEpisodeSearch::Found From(BestEpisodeSearch search, const StateVector& start,
                              const TorqueTable& table) {
  return search.From(start, {&table, 1}).front();
}

TEST(BestEpisode, EveryAimIsBestAtItsOwn) {
  const TorqueTable tables[] = {kAny, kNine};
  const auto found = Search().From(StateVector(0.1, -0.05, 0.02, 0.1), tables);
  ASSERT_EQ(found.size(), 2);
  for (const auto& [most, fastest] : found) {
    EXPECT_GE(most.reward_sum, fastest.reward_sum);
    EXPECT_LE(fastest.swing_up_seconds, most.swing_up_seconds);
    EXPECT_GT(most.reward_sum, 2700);
  }
  for (const double u : found[0].of_return.torques) EXPECT_LE(std::abs(u), 5);
  for (const double u : found[1].of_return.torques) {
    EXPECT_TRUE(std::ranges::find(kNine, u) != kNine.end()) << u;
  }
}

TEST(BestEpisode, MirroredStartsAreAsGood) {
  const BestEpisodeSearch search = Search();
  const StateVector start(0.1, -0.05, 0.02, 0.1);
  const auto here = From(search, start, kAny), mirrored = From(search, -start, kAny);
  EXPECT_NEAR(here.of_return.reward_sum, mirrored.of_return.reward_sum, 0.5);
  EXPECT_NEAR(here.of_time.swing_up_seconds, mirrored.of_time.swing_up_seconds, 1e-9);
}

TEST(BestEpisode, SingleTorquesCannotMakeItBetter) {
  const BestEpisodeSearch search = Search();
  const BestEpisode best = From(search, StateVector::Zero(), kNine).of_return;
  PendulumModel model{Plant()};
  const auto return_of = [&](const std::vector<double>& torques) {
    StateVector x = StateVector::Zero();
    double sum = 0;
    for (size_t t = 0; t < 500; ++t) {
      const double u = t < torques.size() ? torques[t] : search.Hold(UprightDeviation(x), kNine);
      model.Step({&x, 1}, {&u, 1});
      for (const double term : RewardTerms(Plant(), {x[0], x[1], x[2], x[3]}, u)) sum += term;
    }
    return sum;
  };
  EXPECT_NEAR(return_of(best.torques), best.reward_sum, 1e-9);
  for (size_t t = 0; t < best.torques.size(); t += 7) {
    for (const double level : kNine) {
      std::vector<double> other = best.torques;
      other[t] = level;
      EXPECT_LE(return_of(other), best.reward_sum + 1e-9);
    }
  }
}

/// The least time in which full torque, switched at most four times at multiples of 0.08 s, brings
/// the plant from hanging to where the regulator catches it inverted: all 3,000 ways are tried.
double LeastBangBangSeconds(const Plant& plant, int last_step) {
  constexpr int kGrid = 4, kSwitches = 4;
  struct Branch {
    StateVector x;
    double u;
    int switches;
  };
  const LqrCatch upright(LqrConfig(), plant);
  PendulumModel model(plant);
  std::vector<Branch> branches{{StateVector::Zero(), plant.torque_limit, 0}};
  for (int t = 0; t < last_step; t += kGrid) {
    for (size_t i = 0, n = branches.size(); i < n && t > 0; ++i) {
      const Branch b = branches[i];
      if (b.switches < kSwitches) branches.push_back({b.x, -b.u, b.switches + 1});
    }
    for (Branch& b : branches) {
      for (int k = 0; k < kGrid; ++k) model.Step({&b.x, 1}, {&b.u, 1});
      if (Inverted({b.x[0], b.x[1], b.x[2], b.x[3]}) &&
          upright.Holds(UprightDeviation(b.x), model)) {
        return (t + kGrid) * kControlPeriod;
      }
    }
  }
  return last_step * kControlPeriod;
}

TEST(BestEpisode, NoTimesOfFourSwitchesAreFaster) {
  const double seconds = From(Search(), StateVector::Zero(), kAny).of_time.swing_up_seconds;
  EXPECT_LT(seconds, 2.3);
  EXPECT_GE(LeastBangBangSeconds(Plant(), static_cast<int>(std::lround(seconds / 0.02))),
            seconds - 0.02);
}

}  // namespace
}  // namespace upswing
