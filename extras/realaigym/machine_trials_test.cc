#include "extras/realaigym/machine_trials.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <vector>

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

}  // namespace
}  // namespace upswing::realaigym
