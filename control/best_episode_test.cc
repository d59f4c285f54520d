#include "control/best_episode.h"

#include <gtest/gtest.h>

#include <cmath>
#include <vector>

namespace upswing {
namespace {

const std::vector<double> kNine{-5, -3.75, -2.5, -1.25, 0, 1.25, 2.5, 3.75, 5};

double ScoreOf(const BestEpisode& episode, Aim aim) {
  return aim == Aim::kReturn ? episode.reward_sum : -episode.swing_up_seconds;
}

TEST(BestEpisode, EveryAimIsBestAtItsOwn) {
  for (const auto& levels : {std::vector<double>(), kNine}) {
    BestEpisodeSearch search(Plant(), levels, 6);
    const StateVector start(0.1, -0.05, 0.02, 0.1);
    const BestEpisode most = search.From(start, Aim::kReturn);
    const BestEpisode fastest = search.From(start, Aim::kTime);
    EXPECT_GE(most.reward_sum, fastest.reward_sum);
    EXPECT_LE(fastest.swing_up_seconds, most.swing_up_seconds);
    EXPECT_GT(most.reward_sum, 2700);
    for (const double u : most.torques) {
      if (levels.empty()) {
        EXPECT_LE(std::abs(u), 5);
      } else {
        EXPECT_TRUE(std::ranges::find(levels, u) != levels.end()) << u;
      }
    }
  }
}

TEST(BestEpisode, MirroredStartsAreAsGood) {
  BestEpisodeSearch search(Plant(), {}, 6);
  const StateVector start(0.1, -0.05, 0.02, 0.1);
  for (const Aim aim : {Aim::kReturn, Aim::kTime}) {
    EXPECT_NEAR(ScoreOf(search.From(start, aim), aim), ScoreOf(search.From(-start, aim), aim), 0.5);
  }
}

TEST(BestEpisode, SingleTorquesCannotMakeItBetter) {
  BestEpisodeSearch search(Plant(), kNine, 6);
  const BestEpisode best = search.From(StateVector::Zero(), Aim::kReturn);
  PendulumModel model{Plant()};
  const auto return_of = [&](const std::vector<double>& torques) {
    StateVector x = StateVector::Zero();
    double sum = 0;
    for (size_t t = 0; t < 500; ++t) {
      const double u = t < torques.size() ? torques[t] : search.Hold(UprightDeviation(x));
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
  BestEpisodeSearch search(Plant(), {}, 6);
  const double seconds = search.From(StateVector::Zero(), Aim::kTime).swing_up_seconds;
  EXPECT_LT(seconds, 2.3);
  EXPECT_GE(LeastBangBangSeconds(Plant(), static_cast<int>(std::lround(seconds / 0.02))),
            seconds - 0.02);
}

}  // namespace
}  // namespace upswing
