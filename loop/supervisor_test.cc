#include "loop/supervisor.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <numbers>

#include "core/error.h"

namespace upswing {
namespace {

using enum LoopState;

constexpr double kCycle = 0.002;  // s
constexpr double kNan = std::numeric_limits<double>::quiet_NaN();
constexpr double kQuantum = 0.0004, kRange = 12.5;  // rad

/// A supervisor and the facts of its next cycle.
struct Bench {
  Limits limits;
  Supervisor supervisor{limits, {}, {5, 0.5}, kRange, kQuantum};
  CycleFacts facts{.fresh = true};

  explicit Bench(const Limits& l = {}) : limits(l) {}

  LoopState Step() {
    facts.time += kCycle;
    if (facts.fresh) facts.read_at = facts.time;
    facts.age = facts.time - facts.read_at;
    return supervisor.Step(facts);
  }
  /// Runs a cycle with another estimate.
  LoopState Step(const PendulumState& state) {
    facts.state = state;
    return Step();
  }
  LoopState Step(int cycles) {
    for (int i = 0; i < cycles; ++i) Step();
    return supervisor.state();
  }
  void Arm() { ASSERT_EQ(Step(Supervisor::kArmReadings), kArmed); }
  void Run() {
    Arm();
    ASSERT_EQ(Step(), kRunning);
  }
};

TEST(Supervisor, ArmsAfterReadingsInARow) {
  Bench b;
  EXPECT_EQ(b.Step(Supervisor::kArmReadings - 1), kIdle);
  b.facts.fresh = false;
  EXPECT_EQ(b.Step(), kIdle);
  b.facts.fresh = true;
  EXPECT_EQ(b.Step(Supervisor::kArmReadings - 1), kIdle);
  EXPECT_EQ(b.Step(), kArmed);
  EXPECT_EQ(b.supervisor.Torque({1, 0}, b.facts), (Joints{0, 0}));
}

TEST(Supervisor, FaultsWithoutReadings) {
  Bench b;
  b.facts.fresh = false;
  b.Step(static_cast<int>(b.limits.patience / kCycle) - 2);
  EXPECT_EQ(b.supervisor.state(), kIdle);
  EXPECT_EQ(b.Step(4), kFault);
  EXPECT_EQ(b.supervisor.reason(), "no readings within 10 s");
}

TEST(Supervisor, WaitsForTheStartState) {
  Bench b;
  b.Arm();
  EXPECT_EQ(b.Step({1, 0, 0, 0}), kArmed);
  EXPECT_EQ(b.Step({0, 0, 1, 0}), kArmed);
  EXPECT_EQ(b.Step({0, 1, 0, 0}), kArmed);
  // A whole turn is the same place.
  EXPECT_EQ(b.Step({2 * std::numbers::pi, 0, 0, 0}), kRunning);
}

TEST(Supervisor, FaultsIfTheStartStateDoesNotCome) {
  Bench b;
  b.Arm();
  b.Step({1, 0, 0, 0});
  EXPECT_EQ(b.Step(static_cast<int>(b.limits.patience / kCycle) + 2), kFault);
  EXPECT_NE(b.supervisor.reason().find("start state"), std::string::npos);
}

TEST(Supervisor, AStopBeforeTheRunEndsIt) {
  for (const bool armed : {false, true}) {
    Bench b;
    if (armed) b.Arm();
    b.facts.stop = true;
    b.facts.state = {1, 0, 0, 0};
    EXPECT_EQ(b.Step(), kIdle);
    EXPECT_TRUE(b.supervisor.ended());
    EXPECT_EQ(b.supervisor.reason(), "");
  }
}

TEST(Supervisor, CutsTorques) {
  Bench b;
  b.Run();
  EXPECT_EQ(b.supervisor.Torque({1, -0.2}, b.facts), (Joints{1, -0.2}));
  EXPECT_EQ(b.supervisor.clipped(), 0);
  EXPECT_EQ(b.supervisor.Torque({9, -2}, b.facts), (Joints{5, -0.5}));
  EXPECT_EQ(b.supervisor.clipped(), 1);
}

TEST(Supervisor, ATorqueThatIsNotFiniteIsAFault) {
  for (const double torque : {kNan, std::numeric_limits<double>::infinity()}) {
    Bench b;
    b.Run();
    EXPECT_EQ(b.supervisor.Torque({torque, 0}, b.facts), (Joints{0, 0}));
    EXPECT_EQ(b.supervisor.state(), kFault);
  }
}

TEST(Supervisor, BrakesAtAStopUntilTheLinksHang) {
  Bench b;
  b.Run();
  b.facts.stop = true;
  EXPECT_EQ(b.Step({0.1, 0, 2, -1}), kBraking);
  const Joints damping = b.supervisor.Torque({3, 3}, b.facts);
  EXPECT_DOUBLE_EQ(damping[0], -2 * b.limits.brake_damping);
  EXPECT_DOUBLE_EQ(damping[1], b.limits.brake_damping);
  b.Step({0.1, 0, 0, 0});
  EXPECT_EQ(b.Step(98), kBraking);
  EXPECT_EQ(b.Step(4), kIdle);
  EXPECT_TRUE(b.supervisor.ended());
  EXPECT_EQ(b.supervisor.Torque({3, 3}, b.facts), (Joints{0, 0}));
  EXPECT_EQ(b.supervisor.reason(), "");
}

TEST(Supervisor, BrakesSlowLinksThatStand) {
  Bench b;
  b.Run();
  b.facts.stop = true;
  b.Step({std::numbers::pi, 0, 0, 0});
  b.Step(static_cast<int>(b.limits.brake_seconds / kCycle) - 2);
  EXPECT_EQ(b.supervisor.state(), kBraking);
  EXPECT_EQ(b.Step(4), kIdle);  // its longest time
}

TEST(Supervisor, BrakesBeyondLimitsAndThenFaults) {
  Limits tight;
  tight.velocity = 3;
  tight.angle = 2;
  tight.energy = 1.5;
  const auto expect_brake = [&](const PendulumState& state, double energy, const char* word) {
    Bench b(tight);
    b.Run();
    b.facts.energy = energy;
    EXPECT_EQ(b.Step(state), kBraking) << word;
    EXPECT_NE(b.supervisor.reason().find(word), std::string::npos) << b.supervisor.reason();
    b.facts.energy = 0;
    b.Step({0, 0, 0, 0});
    EXPECT_EQ(b.Step(101), kFault);
    EXPECT_EQ(b.supervisor.Torque({3, 3}, b.facts), (Joints{0, 0}));
  };
  expect_brake({0, 0, -3.1, 0}, 0, "velocity");
  expect_brake({0, 0, 0, 3.1}, 0, "velocity");
  expect_brake({2.1, 0, 0, 0}, 0, "angle");
  expect_brake({0, -2.1, 0, 0}, 0, "angle");
  expect_brake({0, 0, 0, 0}, 1.6, "energy");
  expect_brake({0, 0, kNan, 0}, 0, "velocity");
}

TEST(Supervisor, ReadingsThatAreNoNumbersAreFaultsInEveryState) {
  const auto expect_fault = [](Bench& b) {
    b.facts.angle[1] = kNan;
    EXPECT_EQ(b.Step(), kFault);
    EXPECT_EQ(b.supervisor.reason(), "joint 2: expected a finite reading, got another number");
    EXPECT_EQ(b.supervisor.Torque({3, 3}, b.facts), (Joints{0, 0}));
    // The fault stays.
    b.facts.angle[1] = 0;
    EXPECT_EQ(b.Step(100), kFault);
  };
  Bench idle, armed, running, braking;
  expect_fault(idle);
  armed.Arm();
  expect_fault(armed);
  running.Run();
  expect_fault(running);
  braking.Run();
  braking.facts.stop = true;
  ASSERT_EQ(braking.Step({0, 0, 2, 0}), kBraking);
  expect_fault(braking);
  Bench torque;
  torque.Run();
  torque.facts.torque[0] = std::numeric_limits<double>::infinity();
  EXPECT_EQ(torque.Step(), kFault);
}

TEST(Supervisor, SilenceIsAFault) {
  for (const bool runs : {false, true}) {
    Bench b;
    b.Arm();
    ASSERT_EQ(b.Step(PendulumState{runs ? 0.0 : 1.0, 0, 0, 0}), runs ? kRunning : kArmed);
    b.facts.fresh = false;
    EXPECT_NE(b.Step(static_cast<int>(b.limits.age / kCycle) - 1), kFault);
    EXPECT_EQ(b.Step(2), kFault);
    EXPECT_NE(b.supervisor.reason().find("s old"), std::string::npos);
  }
}

TEST(Supervisor, ALockedMachineIsAFaultOnceMotorsAreDriven) {
  Bench b;
  b.facts.locked = true;
  b.Arm();
  b.facts.locked = false;
  ASSERT_EQ(b.Step(), kRunning);
  b.facts.locked = true;
  EXPECT_EQ(b.Step(), kFault);
}

TEST(Supervisor, UnlocksAnArmedMachine) {
  Bench b;
  b.Arm();
  b.facts.locked = true;
  EXPECT_EQ(b.Step(), kIdle);
  b.facts.locked = false;
  EXPECT_EQ(b.Step(Supervisor::kArmReadings), kArmed);
  EXPECT_EQ(b.Step(), kRunning);
}

TEST(Supervisor, AnEncoderAtItsEndIsAFault) {
  Bench b;
  b.Run();
  b.facts.angle[0] = -kRange;
  EXPECT_EQ(b.Step(), kFault);
  EXPECT_EQ(b.supervisor.reason(), "joint 1: the encoder saturates at -12.5 rad");
}

TEST(Supervisor, AnEncoderThatSticksIsAFaultWithinTwoCycles) {
  for (const int joint : {1, 2}) {
    Bench b;
    b.Run();
    double& angle = b.facts.angle[static_cast<size_t>(joint - 1)];
    for (int i = 0; i < 100; ++i) {
      angle += 5 * kCycle;  // 5 rad/s
      ASSERT_EQ(b.Step(), kRunning);
    }
    EXPECT_EQ(b.Step(), kRunning);
    EXPECT_EQ(b.Step(), kFault) << joint;
  }
}

TEST(Supervisor, AJointThatComesToRestIsNoFault) {
  // Dry friction stops a joint from 1 rad/s within .1 s; then the encoder repeats its angle.
  Bench b;
  b.Run();
  double speed = 1, angle = 0;
  for (int i = 0; i < 500; ++i) {
    speed = std::max(0.0, speed - 10 * kCycle);
    angle += speed * kCycle;
    b.facts.angle = {std::round(angle / kQuantum) * kQuantum, 0};
    ASSERT_EQ(b.Step(), kRunning) << b.supervisor.reason();
  }
}

TEST(Start, IsParsed) {
  EXPECT_EQ(ParseStart("hanging").q1, 0);
  EXPECT_EQ(ParseStart("upright").q1, std::numbers::pi);
  EXPECT_EQ(ParseStart("1,2,3,-4").w2, -4);
  for (const char* wrong :
       {"", "1", "1,2,3", "1,2,3,4,5", "1,2,3,x", "nan,0,0,0", "1e9,0,0,0", "1,,2,3,4"}) {
    EXPECT_THROW(ParseStart(wrong), Error) << wrong;
  }
}

}  // namespace
}  // namespace upswing
