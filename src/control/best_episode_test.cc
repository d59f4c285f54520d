#include "control/best_episode.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <vector>

namespace upswing {
namespace {

const TorqueTable kAny, kFive{-5, -2.5, 0, 2.5, 5};

BestEpisodeSearch Search() { return {Plant(), 6, {}}; }

TEST(BestEpisode, EveryAimIsBestAtItsOwnAndMirroredStartsAreAsGood) {
  const TorqueTable tables[] = {kAny, kFive};
  const StateVector start(0.04, -0.02, 0.03, -0.05);
  BestEpisodeSearch search = Search();
  const auto found = search.From(start, tables);
  ASSERT_EQ(found.size(), 2);
  for (const auto& [most, fastest] : found) {
    EXPECT_GE(most.reward_sum, fastest.reward_sum);
    EXPECT_LE(fastest.swing_up_seconds, most.swing_up_seconds);
    EXPECT_GT(most.reward_sum, 2700);
  }
  for (const double u : found[0].of_return.torques) EXPECT_LE(std::abs(u), 5);
  for (const double u : found[1].of_return.torques) {
    EXPECT_TRUE(std::ranges::find(kFive, u) != kFive.end()) << u;
  }
  const auto mirrored = search.From(-start, {&kAny, 1}).front();
  EXPECT_NEAR(found[0].of_return.reward_sum, mirrored.of_return.reward_sum, 0.5);
  EXPECT_NEAR(found[0].of_time.swing_up_seconds, mirrored.of_time.swing_up_seconds, 1e-9);
}

void ExpectSingleTorquesCannotMakeItBetter(const BestEpisode& best,
                                           const BestEpisodeSearch& search) {
  PendulumModel model{Plant()};
  const auto return_of = [&](const std::vector<double>& torques) {
    StateVector x = StateVector::Zero();
    double sum = 0;
    for (size_t t = 0; t < 500; ++t) {
      const double u = t < torques.size() ? torques[t] : search.Hold(UprightDeviation(x), kFive);
      model.Step({&x, 1}, {&u, 1});
      for (const double term : RewardTerms(Plant(), {x[0], x[1], x[2], x[3]}, u)) sum += term;
    }
    return sum;
  };
  EXPECT_NEAR(return_of(best.torques), best.reward_sum, 1e-9);
  for (size_t t = 0; t < best.torques.size(); t += 7) {
    for (const double level : kFive) {
      std::vector<double> other = best.torques;
      other[t] = level;
      EXPECT_LE(return_of(other), best.reward_sum + 1e-9);
    }
  }
}

/// The shortest time in which bang-bang torque brings the plant from hanging to where the regulator
/// catches it inverted. The torque switches at most four times, at multiples of 0.08 s; all 3,000
/// ways are tried.
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
      if (Inverted({b.x[0], b.x[1], b.x[2], b.x[3]}) && upright.Holds(UprightDeviation(b.x))) {
        return (t + kGrid) * kControlPeriod;
      }
    }
  }
  return last_step * kControlPeriod;
}

TEST(BestEpisode, NeitherSingleTorquesNorTimesOfFourSwitchesAreBetter) {
  const TorqueTable tables[] = {kAny, kFive};
  BestEpisodeSearch search = Search();
  const auto found = search.From(StateVector::Zero(), tables);
  ExpectSingleTorquesCannotMakeItBetter(found[1].of_return, search);
  const double seconds = found[0].of_time.swing_up_seconds;
  EXPECT_LT(seconds, 2.3);
  EXPECT_GE(LeastBangBangSeconds(Plant(), static_cast<int>(std::lround(seconds / 0.02))),
            seconds - 0.02);
}

}  // namespace
}  // namespace upswing
