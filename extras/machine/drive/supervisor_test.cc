#include "extras/machine/drive/supervisor.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <numbers>

#include "base/error.h"
#include "base/rng.h"

namespace upswing::machine {
namespace {

using enum LoopState;

constexpr double kCycle = 0.002;  // s
constexpr double kNan = std::numeric_limits<double>::quiet_NaN();
constexpr double kQuantum = 0.0004, kRange = 12.5;  // rad
// A start that does not rest: the controller drives without a pulse before it.
constexpr PendulumState kHeld{0, 0, 0.4, 0};

/// A supervisor and the facts of its next cycle.
struct Bench {
  Limits limits;
  PendulumState start = kHeld;
  Supervisor supervisor{{.limits = limits,
                         .start = start,
                         .motor_limit = {5, 0.5},
                         .angle_range = kRange,
                         .quantum = kQuantum}};
  CycleFacts facts{.fresh = true, .expected = {.known = true}};

  explicit Bench(const Limits& l = {}, const PendulumState& s = kHeld) : limits(l), start(s) {}

  LoopState Step() {
    facts.time += kCycle;
    if (facts.fresh) facts.read_at = facts.received = facts.time;
    facts.age = facts.time - facts.read_at;
    return supervisor.Step(facts);
  }
  /// Runs a cycle with another estimate, which is wrong by the same as the encoders' zeros.
  LoopState Step(const PendulumState& state) {
    facts.state = facts.ahead = state;
    facts.zero = {facts.angle[0] - state.q1, facts.angle[1] - state.q2};
    return Step();
  }
  /// Runs a cycle in which the joints move with these velocities (rad/s), as the estimate says.
  LoopState Move(double w1, double w2) {
    facts.angle[0] += w1 * kCycle;
    facts.angle[1] += w2 * kCycle;
    return Step({facts.angle[0], facts.angle[1], w1, w2});
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
  // A single that is sent is not beyond the limit either.
  Supervisor tenth(
      {.limits = {.torque = 0.1}, .start = kHeld, .motor_limit = {5, 5}, .angle_range = kRange});
  CycleFacts facts{.fresh = true};
  for (int i = 1; i < 8; ++i) {
    facts.time = facts.read_at = facts.received = i * kCycle;
    tenth.Step(facts);
  }
  const Joints cut = tenth.Torque({1, -1}, facts);
  EXPECT_LE(static_cast<float>(cut[0]), 0.1);
  EXPECT_NEAR(cut[0], 0.1, 1e-8);
  EXPECT_GE(static_cast<float>(cut[1]), -0.1);
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
  b.Move(2, -1);
  b.facts.stop = true;
  EXPECT_EQ(b.Move(2, -1), kBraking);
  const Joints damping = b.supervisor.Torque({3, 3}, b.facts);
  EXPECT_NEAR(damping[0], -2 * b.limits.brake_damping, 1e-9);
  EXPECT_NEAR(damping[1], b.limits.brake_damping, 1e-9);
  b.Step({0.1, 0, 0, 0});
  EXPECT_EQ(b.Step(98), kBraking);
  EXPECT_EQ(b.Step(4), kIdle);
  EXPECT_TRUE(b.supervisor.ended());
  EXPECT_EQ(b.supervisor.Torque({3, 3}, b.facts), (Joints{0, 0}));
  EXPECT_EQ(b.supervisor.reason(), "");
}

TEST(Supervisor, BrakesBeforeTheVelocityExceedsItsLimit) {
  Bench b({.velocity = 3});
  b.Run();
  ASSERT_EQ(b.Move(2.5, 0), LoopState::kRunning);
  b.facts.ahead.w1 = 2.9;  // the brake needs longer
  EXPECT_EQ(b.Step(), kBraking);
  EXPECT_EQ(b.supervisor.reason(), "velocity: 3.02 rad/s is beyond the limit 3 rad/s");
}

TEST(Supervisor, BrakesOnlyAgainstAMotionOfWhichAllAreSure) {
  Bench b;
  b.Run();
  b.facts.stop = true;
  ASSERT_EQ(b.Move(2, -1), kBraking);
  b.facts.state.w1 = 9;  // the encoder says 2
  b.facts.ahead.w2 = 1;  // joint 2 is about to turn
  Joints torque = b.supervisor.Torque({}, b.facts);
  EXPECT_NEAR(torque[0], -2 * b.limits.brake_damping, 1e-9);
  EXPECT_EQ(torque[1], 0);
  b.facts.fresh = false;
  b.Step();
  EXPECT_EQ(b.supervisor.Torque({}, b.facts), (Joints{0, 0}));
  b.facts.fresh = true;
  b.facts.age = 3 * kCycle;  // an old reading
  EXPECT_EQ(b.supervisor.Torque({}, b.facts), (Joints{0, 0}));
}

TEST(Supervisor, BrakingThatAddsEnergyIsAFault) {
  Bench b;
  b.Run();
  b.facts.stop = true;
  b.facts.energy = 0.5;
  ASSERT_EQ(b.Move(2, 0), kBraking);
  b.facts.energy = 3;  // a single estimate
  EXPECT_EQ(b.Move(2, 0), kBraking);
  b.facts.energy = 0.3;
  for (int i = 0; i < 200; ++i) ASSERT_EQ(b.Move(2, 0), kBraking);
  b.facts.energy = 1;
  for (int i = 0; i < 50 && b.Move(2, 0) == kBraking; ++i) {
  }
  EXPECT_EQ(b.supervisor.state(), kFault);
  EXPECT_EQ(b.supervisor.reason(), "braking does not slow the links: 2 rad/s");
  EXPECT_EQ(b.supervisor.Torque({}, b.facts), (Joints{0, 0}));
}

TEST(Supervisor, BrakingHasALimitOfVelocity) {
  Bench b;
  b.Run();
  double w = 0;
  while (w < 24) b.Move(w += 1, 0);
  b.facts.stop = true;
  ASSERT_EQ(b.Move(24, 0), kBraking);
  while (w < 37) ASSERT_EQ(b.Move(w += 1, 0), kBraking);
  EXPECT_EQ(b.Move(38, 0), kFault);
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
}

TEST(Supervisor, AnEstimateThatIsNotFiniteOrFarFromTheReadingIsAFault) {
  for (const PendulumState& state :
       {PendulumState{0, 0, kNan, 0}, PendulumState{0, kNan, 0, 0},
        PendulumState{std::numeric_limits<double>::infinity(), 0, 0, 0},
        PendulumState{0.3, 0, 0, 0}, PendulumState{0, -0.3, 1, 1}}) {
    for (const bool brakes : {false, true}) {
      Bench b;
      b.Run();
      b.facts.stop = brakes;
      if (brakes) b.Step();
      b.facts.state = b.facts.ahead = state;
      EXPECT_EQ(b.Step(), kFault);
      EXPECT_EQ(b.supervisor.Torque({1, 1}, b.facts), (Joints{0, 0}));
    }
  }
}

TEST(Supervisor, AReadingThatNoMotionExplainsIsAFaultAtOnce) {
  for (const double jump : {2 * std::numbers::pi, -2 * std::numbers::pi, 14.0, 0.05, -0.03}) {
    for (const size_t joint : {0, 1}) {
      for (const bool runs : {false, true}) {
        Bench b({.angle = 100});
        if (runs) b.Run();
        if (!runs) b.Step(3);
        b.facts.angle[joint] += std::min(jump, kRange - 0.1);
        EXPECT_EQ(b.Step(), kFault) << jump;
        EXPECT_NE(b.supervisor.reason().find("jumps by"), std::string::npos);
        EXPECT_EQ(b.supervisor.Torque({1, 1}, b.facts), (Joints{0, 0}));
      }
    }
  }
}

TEST(Supervisor, AnEncoderThatChangesItsSignIsAFaultAtOnce) {
  Bench b;
  b.facts.angle[0] = b.facts.zero[0] = 0.15;
  b.Run();
  double w = 0;
  while (b.facts.angle[0] > 0) ASSERT_EQ(b.Move(w = std::max(w - 1.5, -6.0), 0), kRunning);
  // At 0 the angle hardly changes, but the velocity does.
  b.facts.angle[0] = -b.facts.angle[0];
  EXPECT_EQ(b.Move(-w, 0), kFault) << w;
}

TEST(Supervisor, MotionsOverABadLineAreExplained) {
  // Answers come late by up to 5 ms and get lost; the machine measures in between.
  Rng rng(1, "line");
  for (int run = 0; run < 20; ++run) {
    Bench b({.age = 1});
    b.Run();
    double time = b.facts.time, measured = time, q = 0, w = 0;
    for (int i = 0; i < 2000; ++i) {
      time += kCycle;
      const double goal = 20 * std::sin(0.03 * i + run), before = measured;
      measured = std::max(measured + 1e-6, time + rng.Uniform(0, 0.005));
      const double h = measured - before;
      const double next = w + std::clamp(goal - w, -900 * h, 900 * h);
      q += (w + next) / 2 * h;
      w = next;
      if (rng.Uniform() < 0.2) continue;  // lost
      b.facts.angle[0] = std::round(q / kQuantum) * kQuantum;
      b.facts.zero[0] = b.facts.angle[0];
      b.facts.read_at = time;
      b.facts.time = b.facts.received = std::max(b.facts.time, measured + rng.Uniform(0, 0.002));
      ASSERT_EQ(b.supervisor.Step(b.facts), kRunning) << run << " " << i << b.supervisor.reason();
    }
  }
}

TEST(Supervisor, TorquesFromOldReadingsAreNotSent) {
  Bench b;
  EXPECT_TRUE(b.supervisor.CheckAge(9));  // the motors are off
  b.Run();
  EXPECT_TRUE(b.supervisor.CheckAge(b.limits.age));
  EXPECT_FALSE(b.supervisor.CheckAge(0.7));
  EXPECT_EQ(b.supervisor.reason(), "the last reading is 0.7 s old, beyond the limit 0.02 s");
  EXPECT_EQ(b.Step(), kFault);
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
  ASSERT_EQ(braking.Move(2, 0), kBraking);
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

TEST(Supervisor, MotorsThatStayLockedEndTheWait) {
  Bench b;
  int cycles = 0;
  while (!b.supervisor.ended()) {
    b.facts.locked = true;
    b.Step();
    ASSERT_LT(++cycles, 2 * b.limits.patience / kCycle);
  }
  EXPECT_EQ(b.supervisor.reason(), "the machine's motors stay locked for 10 s");
}

/// A block on each joint, which the torque of joint 1 moves; joint 2 goes the other way.
struct Blocks {
  double mass = 0.03, share = 1;      // kg·m²; of its motion that the encoder of joint 1 shows
  double other = -1.5;                // motion of joint 2 for that of joint 1
  double angle = 0, velocity = 0;     // rad, rad/s
  double largest = 0, strongest = 0;  // velocity, rad/s, and torque, N·m

  void Move(double torque) {
    velocity += torque / mass * kCycle;
    angle += velocity * kCycle;
    largest = std::max(largest, std::abs(velocity));
    strongest = std::max(strongest, std::abs(torque));
  }
};

/// Runs the pulses without a twin until the controller drives or a fault.
std::string Probe(Blocks& blocks) {
  Bench b({}, {});
  b.facts.expected.known = false;
  double torque = 0;
  for (int i = 0; i < 1000 && !b.supervisor.ended() && b.supervisor.state() != kRunning; ++i) {
    blocks.Move(torque);
    b.facts.angle = {blocks.share * blocks.angle, blocks.other * blocks.angle};
    b.facts.zero = b.facts.angle;
    b.Step();
    torque = b.supervisor.Torque({5, 0}, b.facts)[0];
  }
  return b.supervisor.state() == kRunning ? "running" : b.supervisor.reason();
}

TEST(Supervisor, TheControllerDrivesOnceTheEncodersHaveAnswered) {
  for (const double mass : {0.003, 0.03, 0.3}) {
    Blocks good{.mass = mass};
    EXPECT_EQ(Probe(good), "running");
    // The pulses move the links little, and end at rest.
    EXPECT_LT(std::abs(good.angle), 0.05);
    EXPECT_LT(std::abs(good.velocity), 0.1);
    EXPECT_LT(good.largest, 1.5);
  }
}

TEST(Supervisor, AnEncoderThatDoesNotAnswerIsAFault) {
  Blocks dead{.share = 0};
  EXPECT_TRUE(Probe(dead).starts_with("joint 1 does not answer its motor")) << Probe(dead);
  EXPECT_LT(dead.largest, 13);  // half of the usual limit, with full torque at the end
  Blocks other{.other = 0};
  EXPECT_TRUE(Probe(other).starts_with("joint 2 does not answer")) << Probe(other);
  EXPECT_LT(other.largest, 6);
  Blocks reversed{.share = -1};
  EXPECT_TRUE(Probe(reversed).starts_with("joint 1 moves by -0.00")) << Probe(reversed);
  EXPECT_LT(reversed.largest, 0.5);
}

TEST(Supervisor, PulsesWaitUntilTheLinksRest) {
  Bench b({}, {});
  b.facts.expected.known = false;
  b.Arm();
  for (int i = 0; i < 200; ++i) ASSERT_EQ(b.Move(0.4, 0), kArmed);  // slow enough for a start
  for (int i = 0; i < 310 && b.supervisor.state() == kArmed; ++i) b.Move(0, 0);
  EXPECT_EQ(b.supervisor.state(), kProbing);
}

TEST(Supervisor, MotionThatTheTwinPredictsHasToBeSeen) {
  for (const int joint : {0, 1}) {
    Bench b;
    b.Run();
    b.facts.expected = {.known = true, .deviation = {0.01, 0.01}};
    b.facts.expected.unseen[joint] = 0.05;  // within 4 deviations and the steps of the encoder
    EXPECT_EQ(b.Step(10), kRunning);
    b.facts.expected.unseen[joint] = 0.07;
    EXPECT_EQ(b.Step(), kRunning);
    EXPECT_EQ(b.Step(), kFault);
    EXPECT_NE(b.supervisor.reason().find("the twin moves by 0.07 rad"), std::string::npos);
  }
}

TEST(Supervisor, LinksWithoutMotionGetTorquesThatFrictionHolds) {
  Bench b;
  b.Run();
  b.facts.expected = {.known = true, .friction = {0.2, 0.1}, .deviation = {9, 9}};
  b.Step(10);
  EXPECT_EQ(b.supervisor.Torque({0.3, 0}, b.facts), (Joints{0.3, 0}));
  b.Step(150);  // 0.3 s
  EXPECT_NEAR(b.supervisor.Torque({0.3, 0}, b.facts)[0], 0.8 * 0.2, 1e-9);
  // More is permitted until the twin has moved.
  EXPECT_EQ(b.supervisor.Torque({-3, 0}, b.facts), (Joints{-3, 0}));
  b.facts.expected.unseen[0] = -0.2;
  b.Step();
  EXPECT_NEAR(b.supervisor.Torque({-3, 0}, b.facts)[0], -0.8 * 0.2, 1e-9);
  // A motion opens the limits again.
  b.facts.expected.unseen[0] = 0;
  b.Move(1, 0);
  EXPECT_EQ(b.supervisor.Torque({-3, 0}, b.facts), (Joints{-3, 0}));
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
    for (int i = 0; i < 100; ++i)
      ASSERT_EQ(b.Move(joint == 1 ? 5 : 0, joint == 2 ? 5 : 0), kRunning);
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
  EXPECT_EQ(ParsePendulumStart("hanging").q1, 0);
  EXPECT_EQ(ParsePendulumStart("upright").q1, std::numbers::pi);
  EXPECT_EQ(ParsePendulumStart("1,2,3,-4").w2, -4);
  for (const char* wrong :
       {"", "1", "1,2,3", "1,2,3,4,5", "1,2,3,x", "nan,0,0,0", "1e9,0,0,0", "1,,2,3,4"}) {
    EXPECT_THROW(ParsePendulumStart(wrong), Error) << wrong;
  }
}

TEST(Supervisor, PlausibleMotionsFollowTheSizeOfTheMachine) {
  // Both joints accelerate by 5000 rad/s² for 8 ms, which a link of 5 cm can and one of 0.5 m
  // cannot.
  for (const double time : {1.0, 0.3}) {
    Bench bench({.velocity = 1e3});
    bench.supervisor = Supervisor({.limits = bench.limits,
                                   .scale = {.time = time},
                                   .start = {0, 0, 0.4 / time, 0},
                                   .motor_limit = {5, 0.5},
                                   .angle_range = kRange,
                                   .quantum = kQuantum});
    bench.Run();
    double velocity = 0;
    for (int k = 0; k < 4; ++k) {
      velocity += 5000 * kCycle;
      bench.Move(velocity, velocity);
    }
    EXPECT_EQ(bench.supervisor.reason().empty(), time < 1) << bench.supervisor.reason();
  }
}

}  // namespace
}  // namespace upswing::machine
