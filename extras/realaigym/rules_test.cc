#include "extras/realaigym/rules.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <numbers>
#include <set>
#include <span>

#include "base/rng.h"
#include "extras/realaigym/simulation.h"
#include "pendulum/closed_form.h"

namespace upswing::realaigym {
namespace {

TEST(RealAiGymRules, TheFormulaGivesThePublishedScores) {
  // Time, energy, torque cost, smoothness, velocity cost, and score from the pendubot's board. The
  // board rounds its columns, smoothness to 0.001.
  const std::vector<std::array<double, 6>> board{
      {1.15, 7.67, 2.36, .007, 62.07, .682},  {1.15, 7.72, 2.43, .010, 64.33, .659},
      {.71, 9.83, 4.37, .014, 58.15, .596},   {4.13, 9.53, 1.25, .005, 211.34, .536},
      {4.13, 9.53, 1.26, .007, 211.12, .526}, {1.14, 8.35, 2.42, .054, 114.26, .480},
      {4.12, 9.91, 1.77, .083, 211.98, .353}};
  for (const auto& [t, energy, cost, smooth, velocity, score] : board) {
    BoardOutcome o;
    o.swing_up_seconds = t;
    o.energy = energy;
    o.torque_cost = cost;
    o.smoothness = smooth;
    o.velocity_cost = velocity;
    EXPECT_EQ(PerformanceScore(o), 0);  // not swung up
    o.above_line = true;
    EXPECT_NEAR(PerformanceScore(o), score, 0.0037);
  }
}

TEST(RealAiGymRules, ThereAre722Cases) {
  const std::vector<RobustnessCase> cases = RobustnessCases(1);
  EXPECT_EQ(cases.size(), 722);
  EXPECT_EQ(kBoardSimulations, 723);
  std::map<RobustnessRow, std::set<double>> values;
  std::set<uint64_t> seeds;
  for (const RobustnessCase& each : cases) {
    values[each.row].insert(each.value);
    seeds.insert(each.episode.seed);
    const BoardEpisode& e = each.episode;
    const bool pushed = e.pushes[0].amplitude != 0;
    EXPECT_EQ(pushed, each.row == RobustnessRow::kPush);
    EXPECT_EQ(e.delay > 0, each.row == RobustnessRow::kDelay && each.value > 0);
    if (each.row != RobustnessRow::kModel) {
      EXPECT_EQ(e.plant.mass2, BoardPlant().mass2);
    }
    for (const BoardPush& push : std::span(e.pushes).first(3)) {
      if (!pushed) break;
      EXPECT_GE(std::abs(push.amplitude), 0.5);
      EXPECT_LE(std::abs(push.amplitude), 5);
      EXPECT_GE(push.time, 1);
      EXPECT_LE(push.time, 9);
    }
  }
  EXPECT_EQ(seeds.size(), cases.size());
  EXPECT_EQ(values[RobustnessRow::kDelay].size(), 21);
  EXPECT_NEAR(*values[RobustnessRow::kDelay].rbegin(), 0.04, 1e-12);
  EXPECT_EQ(*values[RobustnessRow::kTorqueNoise].rbegin(), 1.1);
  EXPECT_EQ(*values[RobustnessRow::kResponse].begin(), 0.1);
  EXPECT_EQ(cases[21].episode.plant.center1, 0.75 * BoardPlant().center1);
  EXPECT_EQ(cases[209].episode.plant.friction2, 0.2);
}

TEST(RealAiGymRules, ALevelOfNoisePassesAboveOneHalf) {
  const std::vector<RobustnessCase> cases = RobustnessCases(1);
  std::vector<BoardOutcome> outcomes(cases.size());
  EXPECT_EQ(JudgeRobustness(cases, outcomes).score(), 0);
  for (BoardOutcome& o : outcomes) o.at_goal = true;
  EXPECT_NEAR(JudgeRobustness(cases, outcomes).score(), 1, 1e-12);
  // First level of velocity noise: five of ten are not more than half, six are.
  for (size_t i = 210; i < 215; ++i) outcomes[i].at_goal = false;
  EXPECT_NEAR(JudgeRobustness(cases, outcomes).rows[1], 20.0 / 21, 1e-12);
  outcomes[214].at_goal = true;
  EXPECT_EQ(JudgeRobustness(cases, outcomes).rows[1], 1);
  outcomes[0].at_goal = outcomes.back().at_goal = false;
  const Robustness judged = JudgeRobustness(cases, outcomes);
  EXPECT_NEAR(judged.rows[0], 209.0 / 210, 1e-12);
  EXPECT_NEAR(judged.rows[5], 49.0 / 50, 1e-12);
  ASSERT_EQ(judged.curves.size(), 14);
  EXPECT_EQ(judged.curves[0].share[0], 0);
  EXPECT_NEAR(judged.curves[10].share[0], 0.6, 1e-12);
}

/// Torques that depend on the step and on the measured q1.
double Script(int step, double q1) { return 2 * std::sin(0.01 * step) + 0.5 * std::sin(q1); }

/// Acts by Script and records the measurements of the first simulation.
class Scripted : public BoardController {
 public:
  explicit Scripted(std::vector<BoardState>* seen) : seen_(seen) {}
  void Act(int step, const BoardMeasurement& m, size_t count, Lanes& torque) override {
    for (size_t i = 0; i < count; ++i) torque[i] = Script(step, m.q1[i]);
    if (seen_ != nullptr) seen_->push_back({m.q1[0], m.q2[0], m.w1[0], m.w2[0]});
  }

 private:
  std::vector<BoardState>* seen_;
};

struct Played {
  BoardOutcome outcome;
  std::vector<BoardSample> trace;
  std::vector<BoardState> seen;
};

Played Play(const BoardEpisode& episode, Robot robot = Robot::kPendubot) {
  Played played;
  const std::array<BoardEpisode, 1> one{episode};
  played.outcome = SimulateOnBoard(
                       robot, one, [&](size_t) { return std::make_unique<Scripted>(&played.seen); },
                       nullptr, &played.trace)
                       .front();
  return played;
}

TEST(RealAiGymSimulation, OutcomesMatchTheMotion) {
  for (const Robot robot : {Robot::kPendubot, Robot::kAcrobot}) {
    const auto [o, trace, seen] = Play(BoardEpisode(), robot);
    ASSERT_EQ(trace.size(), 5000);
    EXPECT_NEAR(trace.back().time, 9.998, 1e-12);
    double energy = 0, cost = 0, velocity = 0, sum = 0, squares = 0;
    const size_t joint = robot == Robot::kPendubot ? 0 : 1;
    for (size_t k = 0; k + 1 < trace.size(); ++k) {
      const double u = trace[k].torque[0];
      const auto& x = trace[k].state;
      energy += std::abs((trace[k + 1].state[joint] - x[joint]) * u);
      cost += u * u * 0.002;
      velocity += (x[2] * x[2] + x[3] * x[3]) * 0.002;
      sum += trace[k + 1].torque[0] - u;
      squares += std::pow(trace[k + 1].torque[0] - u, 2);
    }
    EXPECT_NEAR(o.energy, energy, 1e-9 * energy);
    EXPECT_NEAR(o.torque_cost, cost, 1e-9 * cost);
    EXPECT_NEAR(o.velocity_cost, velocity, 1e-9 * velocity);
    EXPECT_NEAR(o.smoothness, std::sqrt(squares / 4999 - std::pow(sum / 4999, 2)), 1e-12);
    EXPECT_FALSE(o.above_line);
    EXPECT_NEAR(o.swing_up_seconds, 9.998, 1e-12);
  }
}

TEST(RealAiGymSimulation, ADelayedStateIsTheOneOfThen) {
  BoardEpisode episode;
  episode.delay = 7;
  const Played played = Play(episode);
  for (size_t k = 0; k < 5000; ++k) {
    EXPECT_EQ(played.seen[k], played.trace[k < 7 ? 0 : k - 7].state);
  }
}

TEST(RealAiGymSimulation, TheMotorRespondsByItsShareWithinItsLimit) {
  BoardEpisode episode;
  episode.response = 1.7;
  const Played played = Play(episode);
  double before = 0;
  for (int k = 0; k < 5000; ++k) {
    const BoardSample& now = played.trace[static_cast<size_t>(k)];
    const double wanted = Script(k, now.state[0]);
    before = std::clamp(before + 1.7 * (wanted - before), -6.0, 6.0);
    ASSERT_NEAR(now.torque[0], before, 1e-12) << k;
  }
}

TEST(RealAiGymSimulation, NoiseIsOfItsSize) {
  BoardEpisode episode;
  episode.velocity_noise = 0.4;
  const Played noisy = Play(episode);
  double sum = 0, squares = 0;
  for (size_t k = 0; k < 5000; ++k) {
    EXPECT_EQ(noisy.seen[k][0], noisy.trace[k].state[0]);  // angles have no noise
    const double n = noisy.seen[k][2] - noisy.trace[k].state[2];
    sum += n;
    squares += n * n;
  }
  EXPECT_NEAR(sum / 5000, 0, 0.03);
  EXPECT_NEAR(std::sqrt(squares / 5000), 0.4, 0.02);
  episode.velocity_noise = 0;
  episode.torque_noise = 0.3;
  const Played pushed = Play(episode);
  squares = 0;
  for (int k = 0; k < 5000; ++k) {
    const BoardSample& now = pushed.trace[static_cast<size_t>(k)];
    const double n = now.torque[0] - Script(k, now.state[0]);
    squares += n * n;
  }
  EXPECT_NEAR(std::sqrt(squares / 5000), 0.3, 0.02);
}

TEST(RealAiGymSimulation, APushActsNextToTheMotor) {
  BoardEpisode episode;
  episode.pushes[0] = {5, 2, 0.05};
  const Played pushed = Play(episode), free = Play(BoardEpisode());
  EXPECT_EQ(pushed.trace[800].state, free.trace[800].state);
  EXPECT_NE(pushed.trace[1100].state, free.trace[1100].state);
  // The tables' torque is only the motor's.
  const BoardSample& now = pushed.trace[1000];
  EXPECT_EQ(now.torque[0], Script(1000, now.state[0]));
}

/// Asks for more torque than the motor has.
class Strong : public BoardController {
 public:
  void Act(int, const BoardMeasurement&, size_t count, Lanes& torque) override {
    std::fill_n(torque.begin(), count, 9.0);
  }
};

TEST(RealAiGymSimulation, APushAddsToTheMotorAtItsLimit) {
  for (const Robot robot : {Robot::kPendubot, Robot::kAcrobot}) {
    BoardEpisode episode;
    episode.pushes[0] = {-5, 2, 0.05};
    std::vector<BoardSample> trace;
    SimulateOnBoard(
        robot, {&episode, 1}, [](size_t) { return std::make_unique<Strong>(); }, nullptr, &trace);
    for (const size_t k : {980, 1000, 1040}) {
      const double z = (0.002 * static_cast<double>(k) - 2) / 0.05;
      ClosedFormBatch batch(1);
      batch.SetManipulator(0, ManipulatorOf(BoardPlant()));
      batch.joint[0] = static_cast<double>(robot);
      batch.tau[0] = 6 - 5 * std::exp(-z * z / 2);
      ClosedFormBatch::Array* const state[] = {&batch.q1, &batch.q2, &batch.w1, &batch.w2};
      for (size_t i = 0; i < 4; ++i) (*state[i])[0] = trace[k].state[i];
      Advance(batch, 1, 0, 1, kBoardTimestep);
      for (size_t i = 0; i < 4; ++i) EXPECT_NEAR((*state[i])[0], trace[k + 1].state[i], 1e-12);
    }
  }
}

TEST(RealAiGymSimulation, ABlowUpIsTheWorstOutcome) {
  BoardEpisode episode;
  episode.plant.damping1 = -1e3;
  const BoardOutcome o = Play(episode).outcome;
  EXPECT_FALSE(o.above_line || o.at_goal);
  EXPECT_NEAR(o.swing_up_seconds, 9.998, 1e-12);
  EXPECT_EQ(PerformanceScore(o), 0);
  for (const double penalty : PerformancePenalties(o)) EXPECT_GT(penalty, 0.9);
}

TEST(RealAiGymRules, TheGoalIsAsNearAndAsSlowAsTheySay) {
  const double pi = std::numbers::pi;
  EXPECT_TRUE(AtGoal({pi, 0, 0, 0}));
  EXPECT_TRUE(AtGoal({-5 * pi, 6 * pi, 0, 0}));  // with full turns
  for (const double sign : {1, -1}) {
    EXPECT_TRUE(AtGoal({pi + sign * 0.349, sign * 0.349, sign * 0.999, -sign * 0.999}));
    EXPECT_FALSE(AtGoal({pi + sign * 0.351, 0, 0, 0}));
    EXPECT_FALSE(AtGoal({pi, sign * 0.351, 0, 0}));
    EXPECT_FALSE(AtGoal({pi, 0, sign * 1.001, 0}));
    EXPECT_FALSE(AtGoal({pi, 0, 0, sign * 1.001}));
  }
  EXPECT_FALSE(AtGoal({std::nan(""), 0, 0, 0}));
}

TEST(RealAiGymSimulation, PlaceAndThreadsChangeNoBit) {
  const std::vector<RobustnessCase> cases = RobustnessCases(3);
  std::vector<BoardEpisode> episodes;
  for (size_t i = 0; i < cases.size(); i += 5) episodes.push_back(cases[i].episode);
  const auto make = [](size_t) { return std::make_unique<Scripted>(nullptr); };
  ThreadPool pool(3);
  const auto alone = SimulateOnBoard(Robot::kPendubot, episodes, make, nullptr);
  const auto together = SimulateOnBoard(Robot::kPendubot, episodes, make, &pool);
  for (size_t i = 0; i < episodes.size(); ++i) {
    EXPECT_EQ(alone[i].velocity_cost, together[i].velocity_cost);
    if (i % 9 != 0) continue;
    const std::array<BoardEpisode, 1> one{episodes[i]};
    EXPECT_EQ(SimulateOnBoard(Robot::kPendubot, one, make, nullptr)[0].energy, alone[i].energy);
  }
}

}  // namespace
}  // namespace upswing::realaigym
