#include "extras/realaigym/rules.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <numbers>
#include <set>
#include <vector>

#include "extras/realaigym/hardware.h"
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
    for (const BoardPush& push : e.pushes) {
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
  std::vector<PendulumState> ends(cases.size());
  const PendulumState up{std::numbers::pi, 0, 0, 0}, down{};
  EXPECT_EQ(JudgeRobustness(cases, ends).score(), 0);
  std::ranges::fill(ends, up);
  EXPECT_NEAR(JudgeRobustness(cases, ends).score(), 1, 1e-12);
  // First level of velocity noise: five of ten are not more than half, six are.
  for (size_t i = 210; i < 215; ++i) ends[i] = down;
  EXPECT_NEAR(JudgeRobustness(cases, ends).rows[1], 20.0 / 21, 1e-12);
  ends[214] = up;
  EXPECT_EQ(JudgeRobustness(cases, ends).rows[1], 1);
  ends[0] = ends.back() = down;
  const Robustness judged = JudgeRobustness(cases, ends);
  EXPECT_NEAR(judged.rows[0], 209.0 / 210, 1e-12);
  EXPECT_NEAR(judged.rows[5], 49.0 / 50, 1e-12);
  ASSERT_EQ(judged.curves.size(), 15);
  EXPECT_EQ(judged.curves[0].share[0], 0);
  EXPECT_NEAR(judged.curves[10].share[0], 0.6, 1e-12);
}

/// Torques that depend on the step and on the measured q1.
double Script(int step, double q1) { return 2 * std::sin(0.01 * step) + 0.5 * std::sin(q1); }

struct Played {
  MachineLog log;
  std::vector<CycleInput> seen;
};

/// Acts by Script, and records the measurements.
Played Play(const BoardEpisode& episode, Robot robot = Robot::kPendubot) {
  Played played;
  played.log = SimulateEpisode(robot, episode, [&](const CycleInput& in) {
    const int step = static_cast<int>(played.seen.size());
    EXPECT_NEAR(in.time, 0.002 * step, 1e-12);
    played.seen.push_back(in);
    Joints torque{};
    torque[MotorOf(robot)] = Script(step, in.angle[0]);
    return torque;
  });
  return played;
}

TEST(RealAiGymSimulation, OutcomesMatchTheMotion) {
  for (const Robot robot : {Robot::kPendubot, Robot::kAcrobot}) {
    const MachineLog log = Play(BoardEpisode(), robot).log;
    const BoardOutcome o = OutcomeOf(log);
    ASSERT_EQ(log.rows(), 5000);
    EXPECT_NEAR(log.time.back(), 9.998, 1e-12);
    double energy = 0, cost = 0, velocity = 0, sum = 0, squares = 0;
    const size_t j = MotorOf(robot);
    for (size_t k = 0; k + 1 < log.time.size(); ++k) {
      const double u = log.commanded[k][j];
      const auto [w1, w2] = log.velocity[k];
      energy += std::abs((log.angle[k + 1][j] - log.angle[k][j]) * u);
      cost += u * u * 0.002;
      velocity += (w1 * w1 + w2 * w2) * 0.002;
      sum += log.commanded[k + 1][j] - u;
      squares += std::pow(log.commanded[k + 1][j] - u, 2);
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
    EXPECT_EQ(played.seen[k].angle, played.log.angle[k < 7 ? 0 : k - 7]);
    EXPECT_EQ(played.seen[k].velocity, played.log.velocity[k < 7 ? 0 : k - 7]);
  }
}

TEST(RealAiGymSimulation, TheMotorRespondsByItsShareWithinItsLimit) {
  BoardEpisode episode;
  episode.response = 1.7;
  const MachineLog log = Play(episode).log;
  double before = 0;
  for (int k = 0; k < 5000; ++k) {
    const double wanted = Script(k, log.angle[k][0]);
    before = std::clamp(before + 1.7 * (wanted - before), -6.0, 6.0);
    ASSERT_NEAR(log.commanded[k][0], before, 1e-12) << k;
  }
}

TEST(RealAiGymSimulation, NoiseIsOfItsSize) {
  BoardEpisode episode;
  episode.velocity_noise = 0.4;
  const Played noisy = Play(episode);
  double sum = 0, squares = 0;
  for (size_t k = 0; k < 5000; ++k) {
    EXPECT_EQ(noisy.seen[k].angle, noisy.log.angle[k]);  // angles have no noise
    const double n = noisy.seen[k].velocity[0] - noisy.log.velocity[k][0];
    sum += n;
    squares += n * n;
  }
  EXPECT_NEAR(sum / 5000, 0, 0.03);
  EXPECT_NEAR(std::sqrt(squares / 5000), 0.4, 0.02);
  episode.velocity_noise = 0;
  episode.torque_noise = 0.3;
  const MachineLog log = Play(episode).log;
  squares = 0;
  for (int k = 0; k < 5000; ++k) {
    const double n = log.commanded[k][0] - Script(k, log.angle[k][0]);
    squares += n * n;
  }
  EXPECT_NEAR(std::sqrt(squares / 5000), 0.3, 0.02);
}

TEST(RealAiGymSimulation, APushActsNextToTheMotorAlsoAtItsLimit) {
  for (const Robot robot : {Robot::kPendubot, Robot::kAcrobot}) {
    BoardEpisode episode;
    episode.pushes[0] = {-5, 2, 0.05};
    const size_t motor = MotorOf(robot);
    const MachineLog log = SimulateEpisode(robot, episode, [&](const CycleInput&) {
      Joints torque{};
      torque[motor] = 9;  // more than the motor has
      return torque;
    });
    for (const size_t k : {100, 980, 1000, 1040}) {
      EXPECT_EQ(log.commanded[k][motor], 6);  // without the push
      const double z = (0.002 * static_cast<double>(k) - 2) / 0.05;
      ClosedFormBatch batch(1);
      batch.SetManipulator(0, ManipulatorOf(BoardPlant()));
      batch.joint[0] = static_cast<double>(robot);
      batch.tau[0] = 6 - 5 * std::exp(-z * z / 2);
      const auto &q = log.angle, &w = log.velocity;
      batch.SetState(0, {q[k][0], q[k][1], w[k][0], w[k][1]});
      Advance(batch, 1, 0, 1, kBoardTimestep);
      EXPECT_NEAR(batch.q1[0], q[k + 1][0], 1e-12);
      EXPECT_NEAR(batch.q2[0], q[k + 1][1], 1e-12);
      EXPECT_NEAR(batch.w1[0], w[k + 1][0], 1e-11);
      EXPECT_NEAR(batch.w2[0], w[k + 1][1], 1e-11);
    }
  }
}

TEST(RealAiGymSimulation, ABlowUpIsAFailure) {
  BoardEpisode episode;
  episode.plant.damping1 = -1e3;
  const MachineLog log = Play(episode).log;
  const auto &q = log.angle.back(), &w = log.velocity.back();
  EXPECT_FALSE(AtGoal({q[0], q[1], w[0], w[1]}));
  EXPECT_FALSE(OutcomeOf(log).above_line);
  EXPECT_EQ(PerformanceScore(OutcomeOf(log)), 0);
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

}  // namespace
}  // namespace upswing::realaigym
