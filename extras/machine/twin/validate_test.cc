#include "extras/machine/twin/validate.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "base/error.h"
#include "base/text.h"
#include "extras/machine/twin/identify.h"
#include "extras/machine/twin/simulated_machine.h"
#include "extras/machine/twin/testing.h"

namespace upswing::machine {
namespace {

Twin RealPlant() { return ReadTwin("realaigym-c1", "test"); }

/// Logs of a machine with friction on two days, with other zeros or torque offsets on each.
std::vector<MachineLog> LogsOfTwoDays(HangingBy cause = HangingBy::kZeros) {
  std::vector<MachineLog> logs;
  for (int i = 0; i < 4; ++i) {
    Twin machine = RealPlant();
    machine.actuator.lag = 0.004;
    if (cause == HangingBy::kZeros) {
      machine.sensors.zero1 = i < 2 ? 0.02 : -0.03;
    } else {
      machine.actuator.torque_offset1 = i < 2 ? 0.2 : -0.1;
    }
    logs.push_back(RunLoop(machine, {.seconds = 3, .seed = static_cast<uint64_t>(i)},
                           [&](const CycleInput& in) -> Joints {
                             return {std::sin(5 * in.time + i), 0.5 * std::sin(7 * in.time)};
                           }));
    logs.back().name = Concat(i < 2 ? "monday/" : "tuesday/", i, ".csv");
  }
  return logs;
}

TEST(WindowErrors, AreZeroOnlyForTheRightMachine) {
  const auto logs = LogsOfTwoDays();
  Twin twin = RealPlant();
  twin.actuator.lag = 0.004;
  twin.sensors.zero1 = 0.02;
  // The remaining errors come from the start states, where the torques jump.
  EXPECT_LT(Median(WindowErrors(logs[0], twin, 0.5, false)), 2e-3);
  EXPECT_LT(Median(WindowErrors(logs[0], twin, 0.5, true)), 2e-3);
  twin.plant.coulomb1 = 0.1;
  EXPECT_GT(Median(WindowErrors(logs[0], twin, 0.5, false)), 2e-2);
}

TEST(CompareErrors, GroupsBySessionAndComparesTheFirstWithTheLast) {
  const auto logs = LogsOfTwoDays();
  Twin good = RealPlant(), bad = RealPlant();
  good.actuator.lag = 0.004;
  bad.plant.coulomb2 = 0;
  const std::vector<Predictor> predictors{PredictorOf("good", good, logs),
                                          PredictorOf("bad", bad, logs)};
  const std::vector<double> lengths{0.5};
  const auto rows = CompareErrors(logs, predictors, lengths, nullptr);
  ASSERT_EQ(rows.size(), 6u);  // two sessions and all, commanded and reported
  EXPECT_EQ(rows[0].session, "monday/");
  EXPECT_EQ(rows[0].runs, 2);
  EXPECT_EQ(rows[2].session, "");
  EXPECT_EQ(rows[2].windows, rows[0].windows + rows[1].windows);
  EXPECT_FALSE(rows[2].reported);
  EXPECT_TRUE(rows[3].reported);
  EXPECT_NEAR(rows[2].improvement.value, 1 - rows[2].errors[0].value / rows[2].errors[1].value,
              1e-12);
  ASSERT_TRUE(rows[2].improvement.interval);
  EXPECT_LE(rows[2].improvement.interval->low, rows[2].improvement.value);
}

TEST(Identify, ChoosesFrictionAndFindsTheSessions) {
  Twin first = RealPlant();
  first.plant.coulomb1 = first.plant.coulomb2 = 0;
  IdentifyConfig config;
  config.folds = 2;
  config.fit = {.windows = {1, 1}, .iterations = 8};
  const auto logs = LogsOfTwoDays();
  const Identification found = Identify(logs, first, config, nullptr);
  ASSERT_EQ(found.structures.size(), 9u);
  // The last structure, with a body of each session, is as good.
  EXPECT_GE(found.chosen, 5);
  EXPECT_NEAR(found.fit.twin.plant.coulomb1, 0.16, 0.005);
  ASSERT_EQ(found.fit.twin.sessions.size(), 2u);
  EXPECT_NEAR(InSession(found.fit.twin, logs[0]).sensors.zero1, 0.02, 0.003);
  EXPECT_NEAR(InSession(found.fit.twin, logs[3]).sensors.zero1, -0.03, 0.003);
  EXPECT_EQ(found.left_out.size(), logs.size());
  // Offsets of the torques are as good besides the zeros, but not in place of them.
  const Structure& chosen = found.structures[found.chosen].structure;
  EXPECT_EQ(std::ranges::count(chosen.values, "torque_offset1"), 0);
  EXPECT_GT(found.structures[6].error, 2 * found.structures[5].error);
}

TEST(Identify, ChoosesOffsetsOfTheTorques) {
  IdentifyConfig config;
  config.folds = 2;
  config.fit = {.windows = {1, 1}, .iterations = 8};
  const auto logs = LogsOfTwoDays(HangingBy::kOffsets);
  const Identification found = Identify(logs, RealPlant(), config, nullptr);
  const Structure& chosen = found.structures[found.chosen].structure;
  EXPECT_EQ(std::ranges::count(chosen.values, "torque_offset1"), 1);
  EXPECT_EQ(std::ranges::count(chosen.of_session, "torque_offset1"), 1);
  EXPECT_LT(found.structures[6].error, found.structures[5].error / 2);
  EXPECT_NEAR(InSession(found.fit.twin, logs[0]).actuator.torque_offset1, 0.2, 0.01);
  EXPECT_NEAR(InSession(found.fit.twin, logs[3]).actuator.torque_offset1, -0.1, 0.01);
  EXPECT_GT(CovarianceOf(found.fit.twin, "torque_offset1", "torque_offset1"), 0);
  // An adaptation of the twin has them, too.
  EXPECT_EQ(ParseTwin(TwinText(found.fit.twin), "test").sessions.size(), 2u);
}

TEST(Identify, LeavesOutLogsOfSessionsWithASingleLog) {
  std::vector<MachineLog> logs = LogsOfTwoDays();
  logs.resize(2);
  logs[0].name = "slow.csv";
  logs[1].name = "fast.csv";
  IdentifyConfig config;
  config.folds = 2;
  config.fit = {.windows = {1, 1}, .iterations = 1};
  const Identification found = Identify(logs, RealPlant(), config, nullptr);
  ASSERT_EQ(found.left_out.size(), 2u);
  // The twin of the other log does not know the session.
  ASSERT_EQ(found.left_out[0].sessions.size(), 1u);
  EXPECT_EQ(found.left_out[0].sessions[0].name, "fast");
  logs.resize(1);
  EXPECT_THROW(Identify(logs, RealPlant(), config, nullptr), Error);
}

/// Free swings of a machine, whose logs have no torques.
std::vector<MachineLog> FreeSwings(const Twin& machine) {
  std::vector<MachineLog> logs;
  for (int i = 0; i < 2; ++i) {
    logs.push_back(RunLoop(machine, {.seconds = 3, .start = {1.0 + 0.1 * i, 0.5 * i - 0.5, 0, 0}},
                           [](const CycleInput&) { return Joints{}; }));
    logs.back().name = Concat("swing", i);
    logs.back().commanded.clear();
    logs.back().measured.clear();
  }
  return logs;
}

TEST(Identify, FindsAFreeSwingWithoutMotors) {
  Twin machine = RealPlant();
  machine.plant.coulomb1 = machine.plant.coulomb2 = 0.002;
  machine.plant.damping1 = machine.plant.damping2 = 0.003;
  machine.plant.armature = 0;
  const std::vector<MachineLog> logs = FreeSwings(machine);
  Twin first = machine;
  first.plant.inertia1 *= 1.2;
  first.plant.center1 *= 0.9;
  first.plant.coulomb1 = first.plant.coulomb2 = first.plant.damping1 = first.plant.damping2 = 0;
  IdentifyConfig config;
  config.folds = 2;
  config.fit = {.windows = {1, 1}, .iterations = 10};
  const Identification found = Identify(logs, first, config, nullptr);
  EXPECT_GE(found.chosen, 1);
  EXPECT_NEAR(found.fit.twin.plant.inertia1, machine.plant.inertia1, 2e-4);
  EXPECT_LT(Median(WindowErrors(logs[0], found.fit.twin, 1, false)), 2e-3);
}

/// The rotors of motors that are off turn with the links. Without them, the fit takes another
/// length.
TEST(Identify, FindsTheRotorsOfIdleMotorsInAFreeSwing) {
  Twin machine = RealPlant();
  machine.plant.coulomb1 = machine.plant.coulomb2 = 0.002;
  machine.plant.damping1 = machine.plant.damping2 = 0.003;
  machine.plant.armature = 0.003;
  Twin first = machine;
  first.plant.armature = 0;
  first.plant.inertia1 *= 1.2;
  first.plant.center1 *= 0.9;
  IdentifyConfig config;
  config.folds = 0;
  config.fit = {.windows = {1, 1}, .iterations = 30};
  const Identification found = Identify(FreeSwings(machine), first, config, nullptr);
  EXPECT_NEAR(found.fit.twin.plant.armature, machine.plant.armature, 1e-4);
  EXPECT_NEAR(found.fit.twin.plant.length1, machine.plant.length1, 0.002);
}

/// A geared motor at joint 2 has more armature than link 1 has inertia. Only the sum of inertia1
/// and the armature of joint 1 shows in a motion.
TEST(Identify, FindsTheArmatureOfAGearedElbow) {
  Twin machine = RealPlant();
  machine.plant.coulomb1 = machine.plant.coulomb2 = 0.002;
  machine.plant.damping1 = machine.plant.damping2 = 0.003;
  machine.plant.armature = 4 * machine.plant.inertia1;
  machine.plant.armature1 = 0.001;
  Twin first = machine;
  first.plant.armature = 0;
  first.plant.armature1 = -1;
  IdentifyConfig config;
  config.folds = 0;
  config.fit = {.windows = {1, 1}, .iterations = 30};
  const Plant found = Identify(FreeSwings(machine), first, config, nullptr).fit.twin.plant;
  EXPECT_NEAR(found.armature / machine.plant.armature, 1, 0.02);
  EXPECT_EQ(found.armature1, 0);
  EXPECT_NEAR(found.inertia1, machine.plant.inertia1 + machine.plant.armature1, 1e-4);
}

TEST(MeasureLoop, FindsPeriodAndQuanta) {
  Twin machine = RealPlant();
  machine.loop = {.period = 0.002, .jitter = 0.0001, .late_share = 0.05, .late = 0.003};
  machine.sensors.quantum = 0.001;
  machine.sensors.torque_quantum = 0.01;
  const MachineLog log =
      RunLoop(machine, {.seconds = 5, .start = {1, 0, 0, 0}}, [](const CycleInput& in) {
        return Joints{in.time, 0};
      });
  Twin twin;
  MeasureLoop(std::span(&log, 1), twin);
  EXPECT_NEAR(twin.loop.period, 0.002, 1e-5);
  EXPECT_NEAR(twin.loop.jitter, 0.0001, 3e-5);
  EXPECT_NEAR(twin.loop.late_share, 0.05 * 2.5 / 3, 0.02);  // later than a quarter of a period
  EXPECT_NEAR(twin.sensors.quantum, 0.001, 1e-9);
  EXPECT_NEAR(twin.sensors.torque_quantum, 0.01, 1e-9);
}

/// Leave-one-out on a part of the measured runs: a guard for the published comparison.
TEST(Identify, PredictsLeftOutRunsOfTheRealMachine) {
  if (RealData().empty()) GTEST_SKIP() << "no measured data";
  std::vector<MachineLog> logs;
  for (const char* kind : {"swingup/acrobot-tvlqr", "pushed/pendubot-tvlqr"}) {
    for (const int run : {1, 2}) {
      logs.push_back(ReadLog(RealData() / "C.1" / Concat(kind, "-0", run, ".csv.gz")).front());
    }
  }
  const Twin first = RealPlant();
  const Structure structure =
      Structures(/*has_motors=*/true, /*cogging=*/false, /*one_body=*/false).back();
  ThreadPool pool(2);
  std::vector<double> own, published;
  for (const int left_out : {0, 2}) {
    std::vector<MachineLog> others = logs;
    others.erase(others.begin() + left_out);
    const Twin twin = Fit(others, first, structure, {.windows = {1, 2}}, &pool).twin;
    const auto add = [&](std::vector<double>& list, const Twin& t) {
      for (const double e : WindowErrors(logs[left_out], t, 1, false)) list.push_back(e);
    };
    add(own, InSession(twin, logs[left_out]));
    add(published, first);
  }
  EXPECT_LT(Median(own), 0.7 * Median(published));
}

}  // namespace
}  // namespace upswing::machine
