#include "extras/machine/drive/control_loop.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <new>
#include <numbers>
#include <thread>
#include <vector>

#include "base/error.h"
#include "extras/machine/drive/fake_machine.h"
#include "extras/machine/drive/loop_testing.h"
#include "extras/machine/logs/check.h"
#include "os/testing.h"

namespace upswing::machine {
namespace {

FakeLink& FakeOf(LoopBench& bench) { return dynamic_cast<FakeLink&>(*bench.link); }

/// A run on a machine with faults, until it ends or brakes.
LoopBench WithFault(const FakeConfig& fault, const Limits& limits = {}) {
  LoopBench bench;
  bench.limits = limits;
  bench.link = std::make_unique<FakeLink>(bench.twin, fault);
  bench.Make();
  while (bench.loop->Cycle() && bench.supervisor->state() != LoopState::kBraking) {
  }
  return bench;
}

TEST(ControlLoop, SwingsTheTwinAndStops) {
  LoopBench bench;
  bench.link = std::make_unique<FakeLink>(bench.twin, FakeConfig{});
  bench.Make();
  bench.loop->Run();
  EXPECT_EQ(bench.supervisor->reason(), "");
  EXPECT_EQ(bench.supervisor->state(), LoopState::kIdle);
  EXPECT_NEAR(bench.loop->summary().driven, 2, 0.01);
  EXPECT_EQ(bench.loop->summary().unanswered, 0);
  EXPECT_EQ(bench.loop->summary().on_time, bench.loop->summary().cycles);
  EXPECT_FALSE(FakeOf(bench).enabled());
  EXPECT_EQ(FakeOf(bench).torque(), (Joints{0, 0}));
  EXPECT_NEAR(std::abs(FakeOf(bench).machine().state().w1), 0, 0.3);
}

TEST(ControlLoop, SmallFaultsOfTheLineDoNotStopIt) {
  FakeConfig faults;
  faults.line = {.loss = 0.05, .duplicate = 0.05, .reorder = 0.05, .delay = 0.001, .jitter = 0.002};
  LoopBench bench = WithFault(faults);
  EXPECT_EQ(bench.supervisor->reason(), "");
  EXPECT_GT(bench.loop->summary().unanswered, 0);
  EXPECT_NEAR(bench.loop->summary().driven, 2, 0.01);
}

TEST(ControlLoop, EachFaultOfTheMachineEndsInItsState) {
  constexpr double kCycle = 0.002, kAfter = 0.5;  // s; from the first command with motors on
  const auto expect = [&](const char* name, const FakeConfig& config, LoopState state,
                          double detectable, const Limits& limits = {}) {
    LoopBench bench = WithFault(config, limits);
    EXPECT_EQ(bench.supervisor->state(), state) << name << ": " << bench.supervisor->reason();
    EXPECT_NE(bench.supervisor->reason(), "") << name;
    if (detectable > 0) {
      // The motors are on since the cycle after the last reading that arms them.
      const auto cycles = bench.loop->summary().cycles - Supervisor::kArmReadings - 1;
      EXPECT_NEAR(kCycle * static_cast<double>(cycles), detectable, 2.1 * kCycle) << name;
    }
    if (state != LoopState::kFault) return;
    bench.loop->SwitchOff();
    EXPECT_EQ(FakeOf(bench).torque(), (Joints{0, 0})) << name;
    EXPECT_FALSE(FakeOf(bench).enabled()) << name;
  };
  FakeConfig nan;
  nan.machine.nan_after = kAfter;
  expect("NaN", nan, LoopState::kFault, kAfter);
  FakeConfig silent;
  silent.machine.silent_after = kAfter;
  expect("silence", silent, LoopState::kFault, kAfter + Limits().age);
  FakeConfig stuck;
  stuck.machine.stuck_after[0] = 0.85;  // the joint moves at more than 2 rad/s
  expect("stuck", stuck, LoopState::kFault, 0.85);
  FakeConfig saturated;
  saturated.machine.saturate = 0.3;
  expect("saturation", saturated, LoopState::kFault, 0);
  Limits slow;
  slow.velocity = 2;
  expect("over-velocity", {}, LoopState::kBraking, 0, slow);
  Limits weak;
  weak.energy = 0.1;
  expect("energy", {}, LoopState::kBraking, 0, weak);
  Limits narrow;
  narrow.angle = 0.3;
  expect("angle", {}, LoopState::kBraking, 0, narrow);
}

TEST(ControlLoop, BrakesWithinTwoCyclesOfTooFastLinks) {
  LoopBench bench;
  bench.limits.velocity = 3;
  bench.link = std::make_unique<FakeLink>(bench.twin, FakeConfig{});
  bench.Make();
  int late = 0;
  while (bench.loop->Cycle() && bench.supervisor->state() != LoopState::kBraking) {
    const PendulumState& s = FakeOf(bench).machine().state();
    late += std::max(std::abs(s.w1), std::abs(s.w2)) > bench.limits.velocity ? 1 : 0;
  }
  EXPECT_EQ(bench.supervisor->state(), LoopState::kBraking);
  EXPECT_LE(late, 2);
}

TEST(ControlLoop, ALossOfAllFramesForAWhileIsAFault) {
  FakeConfig faults;
  faults.line.loss = 0.75;  // ten lost answers in a row within seconds
  LoopBench bench = WithFault(faults);
  EXPECT_EQ(bench.supervisor->state(), LoopState::kFault);
}

/// The log of a run on a twin with late cycles.
std::string TwinLog(const std::string& path, uint64_t seed) {
  LoopBench bench;
  bench.log_path = path;
  bench.twin.loop = {.period = 0.002, .jitter = 0.0002, .late_share = 0.03, .late = 0.005};
  bench.link = std::make_unique<TwinLink>(bench.twin, PendulumState{}, seed);
  bench.Make();
  bench.loop->Run();
  bench.log->Finish();
  return ReadOwnFile(path);
}

TEST(ControlLoop, ATwinGivesEqualBitsForEqualSeeds) {
  const TempFolder folder;
  const std::string first = TwinLog((folder / "a.csv").string(), 1);
  EXPECT_EQ(first, TwinLog((folder / "b.csv").string(), 1));
  EXPECT_NE(first, TwinLog((folder / "c.csv").string(), 2));
  const std::vector<MachineLog> pieces = ReadLog(folder / "a.csv");
  ASSERT_EQ(pieces.size(), 1U);
  EXPECT_GT(pieces[0].rows(), 900);
  EXPECT_EQ(pieces[0].measured.size(), pieces[0].time.size());
  // The log has the times at which torques were sent: the twin, driven by its commands, repeats the
  // motion.
  const Twin twin = TestTwin();
  const MachineLog& log = pieces[0];
  const PendulumState start{log.angle[0][0], log.angle[0][1], 0, 0};
  const Motion motion = Predict(CommandedModel(log, twin), start, std::span(log.time).first(500));
  for (int k = 0; k < 500; ++k) {
    ASSERT_NEAR(motion.angle[k][0], log.angle[k][0], 0.005) << k;
    ASSERT_NEAR(motion.angle[k][1], log.angle[k][1], 0.005) << k;
  }
}

TEST(ControlLoop, CompensatesTheFrictionOfTheOtherJoint) {
  LoopBench bench;
  bench.twin.plant.coulomb2 = 0.1;
  bench.config.compensation = 1;
  bench.link = std::make_unique<FakeLink>(bench.twin, FakeConfig{});
  bench.Make();
  double largest = 0;
  while (bench.loop->Cycle() && bench.supervisor->state() != LoopState::kBraking) {
    const double velocity = bench.estimator->ahead().w2, torque = FakeOf(bench).torque()[1];
    largest = std::max(largest, std::abs(torque));
    // The torque of the cycle before, away from a change of sign.
    if (bench.loop->summary().driven > 0.1 && std::abs(velocity) > 1) {
      EXPECT_NEAR(torque, std::copysign(0.1 * std::numbers::pi / 2, velocity), 0.002);
    }
  }
  EXPECT_GT(largest, 0.1);
}

TEST(ControlLoop, AnExceptionSwitchesTheMotorsOff) {
  LoopBench bench;
  // Fails in its hundredth cycle, while the motor drives.
  bench.machine_controller = [](int64_t step, const PendulumState& /*state*/) -> double {
    if (step >= 10) throw std::bad_alloc();
    return 1;
  };
  bench.link = std::make_unique<FakeLink>(bench.twin, FakeConfig{});
  bench.Make();
  EXPECT_THROW(bench.loop->Run(), std::bad_alloc);
  EXPECT_GT(bench.loop->summary().driven, 0.1);
  EXPECT_FALSE(FakeOf(bench).enabled());
  EXPECT_EQ(FakeOf(bench).machine().torque(), (Joints{0, 0}));
}

TEST(Supervisor, TakesTheReadingsOfARealMachineForMotions) {
  const std::vector<RealRun> runs = RealRuns();
  if (RealData().empty()) GTEST_SKIP() << "no measured data";
  const Twin twin = ReadTwin("realaigym-twin", "twin");
  int rows = 0, running = 0;
  for (const auto& [file, log, period] : runs) {
    Estimator estimator(twin, period);
    constexpr int kArmed = Supervisor::kArmReadings + 1;
    const Joints& q = log.angle[kArmed];
    const Joints& w = log.velocity[kArmed];
    Supervisor supervisor({.limits = {.angle = 1e3, .velocity = 1e3, .energy = 1e3},
                           .start = {q[0], q[1], w[0], w[1]},
                           .angle_range = 1e3,
                           .quantum = twin.sensors.quantum});
    for (int k = 1; k < log.rows(); ++k, ++rows) {
      const double time = log.time[k];
      const TimedReading reading{{log.angle[k], log.measured[k]}, time};
      estimator.Update(time, log.commanded[k - 1], &reading);
      supervisor.Step({.time = time,
                       .fresh = true,
                       .read_at = log.time[k - 1],
                       .received = time,
                       .angle = log.angle[k],
                       .torque = log.measured[k],
                       .zero = estimator.zero(),
                       .state = estimator.now(),
                       .ahead = estimator.ahead(),
                       .energy = estimator.energy(),
                       .period = period});
    }
    EXPECT_EQ(supervisor.reason(), "") << file;
    running += supervisor.state() == LoopState::kRunning ? 1 : 0;
  }
  EXPECT_GE(running, 23);
  EXPECT_GT(rows, 50'000);
}

TEST(PerCycle, KeepsThePeriodOfAPolicy) {
  const auto angle = [](int64_t /*step*/, const PendulumState& state) { return state.q1; };
  for (const int64_t hz : {100, 250, 400, 500, 1000}) {
    const MachineController controller = PerCycle(angle, hz);
    const int64_t held = hz / 50;  // cycles in 20 ms
    double last = 0;
    for (int64_t cycle = 0; cycle < 10 * held; ++cycle) {
      const double torque = controller(cycle, {3.1 + 1e-4 * static_cast<double>(cycle), 0, 0, 0});
      EXPECT_EQ(torque != last, cycle % held == 0) << hz << " Hz, cycle " << cycle;
      last = torque;
    }
  }
  // After missed cycles it acts once, and then at its own times again.
  const MachineController late = PerCycle(angle, 500);
  const double first = late(0, {3.1, 0, 0, 0}), second = late(47, {3.2, 0, 0, 0});
  EXPECT_NE(first, second);
  EXPECT_EQ(late(49, {3.1, 0, 0, 0}), second);
  EXPECT_EQ(late(50, {3.1, 0, 0, 0}), first);
}

TEST(PerCycle, ActsInTheCyclesNextToThePeriodsOfAPolicy) {
  for (const double cycles : {3.35, 3.17, 2.5, 1.05}) {
    constexpr int64_t kHz = 500;
    int64_t cycle = 0;
    std::vector<int64_t> acts;
    const auto law = [&](int64_t step, const PendulumState& /*state*/) {
      EXPECT_EQ(step, std::ssize(acts)) << cycles;
      acts.push_back(cycle);
      return 0.0;
    };
    const MachineController controller = PerCycle({law, cycles / kHz}, kHz);
    for (; cycle < 100; ++cycle) controller(cycle, {});
    EXPECT_NEAR(static_cast<double>(acts.size()), 100 / cycles, 1) << cycles;
    for (size_t step = 0; step < acts.size(); ++step) {
      const double late = static_cast<double>(acts[step]) - static_cast<double>(step) * cycles;
      EXPECT_LE(std::abs(late), 0.5 + 1e-9) << cycles;
    }
  }
  const auto none = [](int64_t /*step*/, const PendulumState& /*state*/) { return 0.0; };
  EXPECT_NO_THROW(PerCycle({none, 0.00195}, 500));  // which is a cycle, up to 5%
  try {
    PerCycle({none, 0.0012}, 500);
    FAIL();
  } catch (const Error& error) {
    EXPECT_STREQ(error.what(),
                 "--hz: expected 834 or more, for a cycle in 0.0012 s, the control period of the "
                 "policy, got 500");
  }
}

TEST(LogRing, KeepsTheOrderAcrossThreads) {
  LogRing ring(64);
  constexpr int kRows = 100'000;
  std::thread reader([&] {
    LoopRow row;
    for (int next = 0; next < kRows;) {
      if (!ring.Pop(row)) {
        std::this_thread::yield();
        continue;
      }
      ASSERT_EQ(row.time, next);
      ++next;
    }
  });
  for (int i = 0; i < kRows;) {
    if (ring.Push({.time = static_cast<double>(i)})) {
      ++i;
    } else {
      std::this_thread::yield();
    }
  }
  reader.join();
  LogRing full(2);
  EXPECT_TRUE(full.Push({}) && full.Push({}));
  EXPECT_FALSE(full.Push({}));
}

}  // namespace
}  // namespace upswing::machine
