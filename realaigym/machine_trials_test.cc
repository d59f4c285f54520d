#include "realaigym/machine_trials.h"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

#include "core/error.h"
#include "core/text.h"
#include "machine/testing.h"
#include "realaigym/published_tvlqr.h"

namespace upswing {
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

TEST(MachineEpisodes, HaveTheTwinsLagAndLeftoverFriction) {
  const Twin twin = SomeMachine();
  const BoardEpisode nominal = EpisodeOf(twin);
  EXPECT_NEAR(nominal.response, 1 - std::exp(-0.002 / 0.0045), 1e-12);
  EXPECT_NEAR(nominal.body->f1, (1 - kCompensated) * 0.16, 1e-12);
  Rng rng(1, "test");
  double squares = 0, zeros = 0;
  constexpr int kDraws = 2000;
  for (int i = 0; i < kDraws; ++i) {
    const BoardEpisode drawn = DrawEpisode(twin, rng);
    const double error = drawn.body->f1 - nominal.body->f1;
    squares += error * error / kDraws;
    zeros += drawn.zero[1] * drawn.zero[1] / kDraws;
    EXPECT_LE(drawn.delay, 1);
    EXPECT_NE(drawn.pushes[3].amplitude, 0);
  }
  EXPECT_NEAR(std::sqrt(zeros), 0.5 * 0.03, 0.001);
  EXPECT_NEAR(std::sqrt(squares), (1 - kCompensated) * 0.02, 0.0002);
}

TEST(RunTrials, ARegulatorHoldsOnlyFromUprightAndDoesNotSwingUp) {
  Twin twin = SomeMachine();
  const TrialController idle = []() -> CycleController {
    return [](const CycleInput&) { return Joints{}; };
  };
  TrialRules rules{.count = 4};
  const HardwareReport report = RunTrials(twin, Robot::kPendubot, idle, rules, nullptr);
  ASSERT_EQ(report.runs.size(), 4u);
  EXPECT_EQ(report.successes(), 0);
  EXPECT_TRUE(report.pushed);
}

TEST(RunTrials, SameSeedSameRunsForAnyNumberOfThreads) {
  const Twin twin = SomeMachine();
  const TrialController sine = []() -> CycleController {
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

/// The published controller on the twin does what it did on the machine.
TEST(PublishedTvlqr, SwingsUpTheTwinLikeTheMachine) {
  if (RealData().empty()) GTEST_SKIP() << "no measured data";
  std::vector<MachineLog> logs;
  for (int run = 1; run <= 5; ++run) {
    const auto file = RealData() / "C.1" / Concat("swingup/acrobot-tvlqr-0", run, ".csv.gz");
    logs.push_back(ReadLog(file).front());
  }
  const PublishedTvlqr law(logs, Robot::kAcrobot);
  for (const MachineLog& log : logs) EXPECT_LT(law.Misfit(log), 0.05) << log.name;
  const Twin twin = ReadTwin("realaigym-twin", "test");
  const TrialRules rules{.count = 20};
  const HardwareReport report = RunTvlqrTrials(twin, Robot::kAcrobot, law, logs, rules, nullptr);
  EXPECT_GE(report.successes(), 17);
  EXPECT_NEAR(report.mean(), 0.587, 0.08);  // the published mean of ten real runs
}

}  // namespace
}  // namespace upswing
