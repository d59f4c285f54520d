#include "extras/realaigym/machine_trials.h"

#include <gtest/gtest.h>

#include <cmath>
#include <memory>
#include <numbers>
#include <vector>

#include "base/error.h"
#include "base/text.h"
#include "extras/machine/testing.h"
#include "extras/realaigym/published_tvlqr.h"
#include "extras/realaigym/swing_policy.h"
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

TEST(MachineEpisodes, HaveTheTwinsLagAndLeftoverFriction) {
  const Twin twin = SomeMachine();
  const BoardEpisode nominal = EpisodeOf(twin);
  EXPECT_NEAR(nominal.response, 1 - std::exp(-0.002 / 0.0045), 1e-12);
  EXPECT_NEAR(nominal.body->f1, (1 - kCompensated) * 0.16, 1e-12);
  EXPECT_EQ(nominal.angle_range, twin.sensors.angle_range);
  Rng rng(1, "test");
  double squares = 0, zeros = 0;
  int delays = 0;
  constexpr int kDraws = 2000;
  for (int i = 0; i < kDraws; ++i) {
    const BoardEpisode drawn = DrawEpisode(twin, Robot::kPendubot, rng);
    const double error = drawn.body->f1 - nominal.body->f1;
    squares += error * error / kDraws;
    zeros += drawn.zero[1] * drawn.zero[1] / kDraws;
    delays += drawn.delay;
    EXPECT_LE(drawn.delay, 1);
    double before = 0;
    for (size_t k = 0; k < drawn.pushes.size(); ++k) {
      const BoardPush& push = drawn.pushes[k];
      EXPECT_EQ(push.passive, k % 2 == 1);
      EXPECT_NEAR(std::abs(push.amplitude), 0.35, 0.15);
      EXPECT_NEAR(push.width, 0.075, 0.025);
      EXPECT_GE(push.time, before + 1);
      EXPECT_LT(push.time, before + 2.4);
      before = push.time;
    }
  }
  EXPECT_NEAR(delays, kDraws / 2, 100);
  EXPECT_NEAR(std::sqrt(zeros), std::sqrt(1.5 * 1.5 / 3) * 0.03, 0.001);
  EXPECT_NEAR(std::sqrt(squares), (1 - kCompensated) * 0.02, 0.0002);
}

/// Keeps what it measures, and asks for 7 N·m.
class Witness : public BoardController {
 public:
  explicit Witness(BoardMeasurement& measured) : measured_(measured) {}
  void Act(int /*step*/, const BoardMeasurement& measured, size_t /*count*/,
           Lanes& torque) override {
    measured_ = measured;
    torque[0] = 7;
  }

 private:
  BoardMeasurement& measured_;
};

TEST(OnMachine, EstimatesVelocitiesCompensatesFrictionAndKeepsLimits) {
  Twin twin = SomeMachine();
  twin.uncertain.clear();
  twin.covariance.clear();
  twin.actuator.passive_limit = 0.5;
  twin.plant.damping2 = 0;
  BoardMeasurement seen{};
  const CycleController controller =
      OnMachine([&](size_t) { return std::make_unique<Witness>(seen); }, twin, Robot::kPendubot)();
  Joints torque{};
  for (int k = 0; k < 100; ++k) {
    const double time = twin.loop.period * k;
    torque = controller({time, {0.02, twin.sensors.zero2 + 3 * time}, {}});
  }
  EXPECT_TRUE(seen.estimated);
  EXPECT_GT(seen.w2[0], 0.1);
  EXPECT_EQ(torque[0], twin.plant.torque_limit);
  EXPECT_NEAR(torque[1], DryFriction(kCompensated * twin.plant.coulomb2, seen.w2[0]), 1e-12);
}

TEST(SwingNet, EstimatedVelocitiesCountLikeDifferencesOfAngles) {
  const SwingNet net(Robot::kPendubot, 8);
  const std::vector<double> numbers = net.Initial(1);
  const auto differences = net.Control(numbers), estimated = net.Control(numbers);
  const double w1 = 2, w2 = -5;
  Lanes a{}, b{};
  BoardMeasurement measured{};
  for (int step = 0; step < 3; ++step) {
    measured.q1.fill(0.5 + (step - 2) * kBoardTimestep * w1);
    measured.q2.fill(-0.3 + (step - 2) * kBoardTimestep * w2);
    differences->Act(step, measured, kBoardBlock, a);
  }
  measured.w1.fill(w1);
  measured.w2.fill(w2);
  measured.estimated = true;
  estimated->Act(0, measured, kBoardBlock, b);
  EXPECT_NEAR(a[0], b[0], 1e-6);
  measured.w2.fill(0);
  estimated->Act(1, measured, kBoardBlock, b);
  EXPECT_GT(std::abs(a[0] - b[0]), 0.01);
}

TEST(SwingNet, AMirroringNetworkControlsTheMirrorImageBeyondUpright) {
  const SwingNet net(Robot::kPendubot, 8), mirroring(Robot::kPendubot, 8, true);
  const std::vector<double> numbers = net.Initial(1);
  const auto torque = [&](const SwingNet& of, double q1, double sign) {
    Lanes torques{};
    BoardMeasurement measured{};
    measured.SetFirst({sign * q1, sign * 0.8, sign * 2, -sign * 3}, true);
    of.Control(numbers)->Act(0, measured, kBoardBlock, torques);
    return torques[0];
  };
  for (const double q1 : {0.3, -2.8, 3.1}) EXPECT_EQ(torque(mirroring, q1, 1), torque(net, q1, 1));
  for (const double q1 : {3.2, 5.0, -7.0}) {
    EXPECT_EQ(torque(mirroring, q1, 1), -torque(net, q1, -1));
    EXPECT_NE(torque(mirroring, q1, 1), torque(net, q1, 1));
  }
  EXPECT_TRUE(ReadSwingPolicy(mirroring.ToTensors(numbers)).net.mirrors());
  EXPECT_FALSE(ReadSwingPolicy(net.ToTensors(numbers)).net.mirrors());
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

TEST(RunTrials, EndWhereAnEncoderSaturates) {
  Twin twin = SomeMachine();
  const auto seconds = [&](double range) {
    twin.sensors.angle_range = range;
    const TrialController whirl = []() -> CycleController {
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
