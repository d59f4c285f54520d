#include "extras/realaigym/uptime.h"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>
#include <vector>

#include "extras/realaigym/simulation.h"

namespace upswing::realaigym {
namespace {

constexpr double kStep = kBoardTimestep;

/// Steps of the resets of a run of a pendulum that does not move.
std::vector<int> StepsOfResets(const ResetRules& rules, uint64_t seed,
                               const PendulumState& s = {}) {
  Resets resets(rules, seed);
  std::vector<int> steps;
  bool before = false;
  for (int k = 0; k < 30000; ++k) {
    const bool active = resets.Torque(k * kStep, s).has_value();
    if (active && !before) steps.push_back(0);
    if (active) ++steps.back();
    before = active;
  }
  return steps;
}

TEST(Resets, AreFifteenOfAFifthOfASecondAtRandomTimes) {
  EXPECT_EQ(StepsOfResets({}, 1), std::vector<int>(15, 100));
  EXPECT_EQ(StepsOfResets(kHardwareResets, 1), std::vector<int>(10, 500));
  for (uint64_t seed = 1; seed <= 100; ++seed) {
    Resets resets({}, seed);
    double first = 0;
    while (!resets.Torque(first, {})) first += kStep;
    EXPECT_NEAR(first, 3.75, 1 + kStep) << seed;
  }
}

/// The torques of a reset, by the formulas of the benchmark's PID.
TEST(Resets, DriveToARandomPoseByThePidOfTheBenchmark) {
  // Weak gains, so that no torque is limited. At a late time the first reset begins at once.
  const ResetRules rules{.kp = 1, .ki = 0.1, .kd = 1};
  Resets resets(rules, 7);
  const PendulumState a{0.1, -0.2, 0, 0}, b{0.102, -0.201, 1, -0.5};
  const Joints first = *resets.Torque(1000, a);
  const BoardPlant p;
  const double G1 = 9.81 * (p.mass1 * p.center1 + p.mass2 * p.length1);
  const double G2 = 9.81 * p.mass2 * p.center2;
  const auto gravity = [&](const PendulumState& s) {
    const double g2 = G2 * std::sin(s.q1 + s.q2);
    return Joints{G1 * std::sin(s.q1) + g2, g2};
  };
  Joints goal;
  for (size_t j = 0; j < 2; ++j) {
    const double angle = j == 0 ? a.q1 : a.q2;
    const double pid = first[j] - gravity(a)[j];
    goal[j] = angle + pid / (1 + 0.1 * 0.001);
    EXPECT_LE(std::abs(goal[j]), std::numbers::pi);
  }
  // The second call has no derivative yet; the third has one, over 1 ms.
  const Joints second = *resets.Torque(1000.002, b), third = *resets.Torque(1000.004, a);
  for (size_t j = 0; j < 2; ++j) {
    const double ea = goal[j] - (j == 0 ? a.q1 : a.q2), eb = goal[j] - (j == 0 ? b.q1 : b.q2);
    EXPECT_NEAR(second[j] - gravity(b)[j], eb + 1e-4 * (ea + eb), 1e-9);
    EXPECT_NEAR(third[j] - gravity(a)[j], ea + 1e-4 * (2 * ea + eb) + (ea - eb) / 0.001, 1e-9);
  }
}

TEST(Resets, ALimitBeginsOneAndDelaysTheOthers) {
  // A pendulum beyond the limits stays in its first reset.
  EXPECT_EQ(StepsOfResets(kHardwareResets, 1, {0, 0, 21, 0}), std::vector<int>{30000});
  Resets resets(kHardwareResets, 1);
  const auto active = [&](double time, double q1) {
    return resets.Torque(time, {q1, 0, 0, 0}).has_value();
  };
  EXPECT_FALSE(active(1, 0));
  EXPECT_TRUE(active(1.002, 12));  // 3.5 π is 11.0
  for (int k = 1; k < 500; ++k) EXPECT_TRUE(active(1.002 + k * kStep, 0));
  EXPECT_FALSE(active(2.002, 0));
  // The first regular reset comes 1.002 s later than without the limit.
  const auto first = [](Resets& of, double from) {
    double time = from;
    while (!of.Torque(time, {})) time += kStep;
    return time;
  };
  Resets regular(kHardwareResets, 1);
  EXPECT_NEAR(first(resets, 2.004), first(regular, 0) + 1.002, 1.5 * kStep);
}

TEST(Uptime, CountsTimeAboveTheLine) {
  MachineLog log;
  for (int k = 0; k < 30000; ++k) {
    const double time = k * kStep;
    const bool up = time >= 15 && time < 45 && !(time >= 20 && time < 20.5);
    log.time.push_back(time);
    log.angle.push_back({up ? std::numbers::pi : 0, 0});
  }
  EXPECT_NEAR(UptimeOf(log).score, 29.5 / 60, 1e-9);
  EXPECT_EQ(UptimeOf(log).swing_ups, 2);
  EXPECT_FALSE(AboveLine({std::numbers::pi - 0.46, 0}));  // cos 0.451 = 0.9
  EXPECT_TRUE(AboveLine({std::numbers::pi - 0.44, 0}));
}

TEST(Uptime, AControllerBeginsAfreshAfterEachReset) {
  int made = 0, calls = 0;
  const ControllerMaker make = [&]() -> CycleController {
    ++made;
    return [&](const CycleInput&) {
      ++calls;
      return Joints{};
    };
  };
  const auto run = [&] {
    return SimulateEpisode(Robot::kAcrobot, {}, WithResets(make, {}, 1), kUptimeSeconds);
  };
  const MachineLog log = run();
  EXPECT_EQ(made, 16);
  EXPECT_EQ(calls, 30000 - 15 * 100);
  EXPECT_EQ(log.rows(), 30000);
  EXPECT_LT(UptimeOf(log).score, 0.2);
  EXPECT_EQ(run().angle, log.angle);
}

}  // namespace
}  // namespace upswing::realaigym
