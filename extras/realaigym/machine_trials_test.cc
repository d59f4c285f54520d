#include "extras/realaigym/machine_trials.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <vector>

#include "base/error.h"
#include "base/text.h"
#include "extras/machine/testing.h"
#include "extras/realaigym/published_tvlqr.h"
#include "pendulum/friction.h"

namespace upswing::realaigym {
namespace {

Twin SomeMachine() {
  Twin twin = ReadTwin("realaigym-c1", "test");
  twin.actuator.lag = 0.0045;
  twin.actuator.delay = 0.001;
  twin.sensors.quantum = 25.0 / 65535;
  twin.sensors.zero1 = 0.02;
  twin.uncertain = {"coulomb1", "zero2"};
  twin.covariance = {4e-4, 0, 0, 9e-4};
  return twin;
}

TEST(OnMachine, EstimatesVelocitiesCompensatesFrictionAndKeepsLimits) {
  Twin twin = SomeMachine();
  twin.uncertain.clear();
  twin.covariance.clear();
  twin.actuator.passive_limit = 0.5;
  twin.plant.damping2 = 0;
  CycleInput seen{};
  const ControllerMaker witness = [&]() -> CycleController {
    return [&](const CycleInput& in) {
      seen = in;
      return Joints{7, 0};
    };
  };
  const CycleController controller = OnMachine(witness, twin, Robot::kPendubot)(1);
  Joints torque{};
  for (int k = 0; k < 100; ++k) {
    const double time = twin.loop.period * k;
    torque = controller({time, {0.02, twin.sensors.zero2 + 3 * time}, {}});
  }
  EXPECT_GT(seen.velocity[1], 0.1);
  EXPECT_EQ(torque[0], twin.plant.torque_limit);
  EXPECT_NEAR(torque[1], DryFriction(kCompensated * twin.plant.coulomb2, seen.velocity[1]), 1e-12);
}

TEST(OnMachine, ResetsDriveBothMotors) {
  Twin twin = SomeMachine();
  twin.actuator.passive_limit = 0.5;
  const ControllerMaker idle = []() -> CycleController {
    return [](const CycleInput&) { return Joints{}; };
  };
  const TrialController make = OnMachine(idle, twin, Robot::kPendubot, kHardwareResets);
  const std::vector<UptimeRun> found = RunUptimeTrials(twin, make, {.count = 2}, nullptr);
  ASSERT_EQ(found.size(), 2u);
  for (const UptimeRun& run : found) EXPECT_LT(run.score, 0.2);
  // The passive motor's limit does not hold in a reset.
  const CycleController controller = make(1);
  double most = 0;
  for (int k = 0; k < 4500; ++k) {
    most = std::max(most, std::abs(controller({0.002 * k, {1, 1}, {}})[1]));
  }
  EXPECT_GT(most, 0.6);
}

TEST(RunTrials, ARegulatorHoldsOnlyFromUprightAndDoesNotSwingUp) {
  Twin twin = SomeMachine();
  const TrialController idle = [](uint64_t) -> CycleController {
    return [](const CycleInput&) { return Joints{}; };
  };
  TrialRules rules{.count = 4};
  const HardwareReport report = RunTrials(twin, Robot::kPendubot, idle, rules, nullptr);
  ASSERT_EQ(report.runs.size(), 4u);
  EXPECT_EQ(report.successes(), 0);
  EXPECT_TRUE(report.pushed);
}

TEST(RunTrials, EndWhereAnEncoderSaturates) {
  Twin twin = SomeMachine();
  const auto seconds = [&](double range) {
    twin.sensors.angle_range = range;
    const TrialController whirl = [](uint64_t) -> CycleController {
      return [](const CycleInput&) { return Joints{5, 0}; };
    };
    const TrialRules rules{.count = 1, .pushes = false, .largest_velocity = 1e9};
    return RunTrials(twin, Robot::kPendubot, whirl, rules, nullptr).runs.front().seconds;
  };
  EXPECT_LT(seconds(6), seconds(12.5));
  EXPECT_LT(seconds(12.5), 2);
  EXPECT_GT(seconds(1e6), 9.9);
}

TEST(RunTrials, SameSeedSameRunsForAnyNumberOfThreads) {
  const Twin twin = SomeMachine();
  const TrialController sine = [](uint64_t) -> CycleController {
    return [](const CycleInput& in) { return Joints{2 * std::sin(5 * in.time), 0}; };
  };
  TrialRules rules{.count = 6, .seed = 3};
  ThreadPool pool(2);
  const auto a = RunTrials(twin, Robot::kPendubot, sine, rules, nullptr);
  const auto b = RunTrials(twin, Robot::kPendubot, sine, rules, &pool);
  for (size_t i = 0; i < a.runs.size(); ++i) {
    EXPECT_EQ(a.runs[i].outcome.velocity_cost, b.runs[i].outcome.velocity_cost);
  }
  EXPECT_NE(a.runs[0].outcome.velocity_cost, a.runs[1].outcome.velocity_cost);
}

TEST(PublishedTvlqr, RefusesRunsWithoutASwingUp) {
  MachineLog hangs;
  for (int k = 0; k < 100; ++k) {
    hangs.time.push_back(0.002 * k);
    hangs.angle.push_back({0, 0});
    hangs.commanded.push_back({0, 0});
  }
  MachineLog upright = hangs;
  for (Joints& q : upright.angle) q[0] = std::numbers::pi;
  for (const MachineLog& log : {hangs, upright}) {
    EXPECT_THROW(PublishedTvlqr(std::span(&log, 1), Robot::kPendubot), Error);
  }
}

/// The five given runs of a robot's TVLQR, in a folder of the measured data.
std::vector<MachineLog> TvlqrRuns(Robot robot, const char* folder) {
  std::vector<MachineLog> logs;
  for (int run = 1; run <= 5; ++run) {
    const std::string name = Concat(NameOf(robot), "-tvlqr-0", run, ".csv.gz");
    logs.push_back(ReadLog(RealData() / "C.1" / folder / name).front());
  }
  return logs;
}

/// The published controller does the same on the twin as on the machine.
TEST(PublishedTvlqr, SwingsUpTheTwinLikeTheMachine) {
  if (RealData().empty()) GTEST_SKIP() << "no measured data";
  const std::vector<MachineLog> logs = TvlqrRuns(Robot::kAcrobot, "swingup");
  const PublishedTvlqr law(logs, Robot::kAcrobot);
  for (const MachineLog& log : logs) EXPECT_LT(law.Misfit(log), 0.05) << log.name;
  const Twin twin = ReadTwin("realaigym-twin", "test");
  const TrialRules rules{.count = 20};
  const HardwareReport report = RunTvlqrTrials(twin, Robot::kAcrobot, law, logs, rules, nullptr);
  EXPECT_GE(report.successes(), 17);
  EXPECT_NEAR(report.mean(), 0.587, 0.08);  // the published mean of ten real runs
}

TEST(PublishedTvlqr, PushedItEndsLikeEachRealRun) {
  if (RealData().empty()) GTEST_SKIP() << "no measured data";
  const Twin twin = ReadTwin("realaigym-twin", "test");
  for (const Robot robot : {Robot::kAcrobot, Robot::kPendubot}) {
    const PublishedTvlqr law(TvlqrRuns(robot, "swingup"), robot);
    const std::vector<MachineLog> pushed = TvlqrRuns(robot, "pushed");
    const auto real = ScoreHardware(pushed, robot).runs;
    constexpr int kEach = 4;
    const TrialRules rules{.count = kEach * 5};
    const auto trials = RunTvlqrTrials(twin, robot, law, pushed, rules, nullptr).runs;
    for (size_t k = 0; k < 5; ++k) {
      int successes = 0;
      for (size_t i = k; i < trials.size(); i += 5) {
        successes += trials[i].outcome.above_line ? 1 : 0;
      }
      if (real[k].outcome.above_line) {
        EXPECT_GE(successes, 3) << real[k].name;
      } else {
        EXPECT_LE(successes, 1) << real[k].name;
      }
    }
  }
}

}  // namespace
}  // namespace upswing::realaigym
