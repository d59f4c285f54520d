#include "extras/machine/drive/estimator.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <functional>
#include <vector>

#include "base/rng.h"
#include "base/text.h"
#include "extras/machine/logs/log.h"
#include "extras/machine/logs/windows.h"
#include "extras/machine/twin/testing.h"
#include "extras/machine/twin/validate.h"

namespace upswing::machine {
namespace {

/// Errors of an estimator on a twin's machine under changing torques.
struct Errors {
  double angle = 0, velocity = 0;              // rms of the state now, rad and rad/s
  double angle_ahead = 0, velocity_ahead = 0;  // rms of the state when the torque acts
};

Errors ErrorsOf(const Twin& machine_twin, Estimator estimator, double loss = 0) {
  constexpr double kPeriod = 0.002;
  constexpr int kCycles = 2000, kSettling = 50;
  const double horizon = kPeriod + machine_twin.actuator.delay + machine_twin.actuator.lag;
  SimulatedMachine machine(machine_twin, {0.5, -0.3, 0, 0});
  Rng rng(3, "test: loss");
  struct Ahead {
    double time;
    PendulumState state;
  };
  std::vector<Ahead> predictions;
  std::vector<PendulumState> truth;
  Errors e;
  const auto add = [](double& sum, double a, double b) { sum += (a - b) * (a - b); };
  for (int k = 0; k < kCycles; ++k) {
    const double time = k * kPeriod;
    machine.Advance(time);
    const Joints sent{1.5 * std::sin(5 * time) + std::sin(17 * time), 0.3 * std::cos(11 * time)};
    machine.Command(sent);
    const TimedReading reading{machine.Read(), time};
    truth.push_back(machine.state());
    estimator.Update(time, sent, rng.Uniform() < loss ? nullptr : &reading);
    predictions.push_back({time + horizon, estimator.ahead()});
    if (k < kSettling) continue;
    add(e.angle, estimator.now().q1, machine.state().q1);
    add(e.angle, estimator.now().q2, machine.state().q2);
    add(e.velocity, estimator.now().w1, machine.state().w1);
    add(e.velocity, estimator.now().w2, machine.state().w2);
  }
  for (int k = kSettling; k < kCycles; ++k) {
    const double at = predictions[k].time / kPeriod;
    const auto before = static_cast<int>(at);
    if (before + 1 >= kCycles) break;
    const PendulumState s = StateBetween(truth[before], truth[before + 1], kPeriod, at - before);
    add(e.angle_ahead, predictions[k].state.q1, s.q1);
    add(e.angle_ahead, predictions[k].state.q2, s.q2);
    add(e.velocity_ahead, predictions[k].state.w1, s.w1);
    add(e.velocity_ahead, predictions[k].state.w2, s.w2);
  }
  for (double* sum : {&e.angle, &e.velocity, &e.angle_ahead, &e.velocity_ahead}) {
    *sum = std::sqrt(*sum / (2 * (kCycles - kSettling)));
  }
  return e;
}

TEST(Estimator, WithoutATwinIsVelocityEstimate) {
  MachineSensors sensors;
  sensors.velocity_share = 0.2;
  sensors.velocity_dead_zone = 0.1;
  Estimator estimator(sensors, 0.002);
  VelocityEstimate reference(sensors);
  for (int k = 0; k < 100; ++k) {
    const TimedReading reading{{{0.1 * std::sin(0.1 * k), 0.001 * k}, {}}, 0.002 * k};
    const Joints w = reference.Update(reading.time, reading.angle);
    estimator.Update(reading.time, {}, k == 50 ? nullptr : &reading);
    if (k == 50) estimator.Update(reading.time, {}, &reading);
    EXPECT_EQ(estimator.now().q1, reading.angle[0]);
    EXPECT_EQ(estimator.ahead().w1, w[0]);
    EXPECT_EQ(estimator.ahead().w2, w[1]);
  }
  EXPECT_EQ(estimator.energy(), 0);
}

TEST(Estimator, WithATwinPredictsTheStateInWhichTheTorqueActs) {
  const Twin twin = TestTwin();
  const Errors model = ErrorsOf(twin, Estimator(twin, 0.002));
  // Angles to half an encoder's step, velocities to a tenth of a step per cycle, 0.19 rad/s.
  EXPECT_LT(model.angle, 0.5 * twin.sensors.quantum);
  EXPECT_LT(model.velocity, 0.03);
  EXPECT_LT(model.angle_ahead, twin.sensors.quantum);
  EXPECT_LT(model.velocity_ahead, 0.03);
  MachineSensors sensors = twin.sensors;
  sensors.velocity_share = 0.2;
  const Errors plain = ErrorsOf(twin, Estimator(sensors, 0.002));
  EXPECT_GT(plain.velocity, 10 * model.velocity);
  EXPECT_GT(plain.velocity_ahead, 10 * model.velocity_ahead);
}

TEST(Estimator, TorquesMayActEarlyAndReadingsMayBeMissing) {
  Twin early = TestTwin();
  early.actuator.delay = -0.002;
  EXPECT_LT(ErrorsOf(early, Estimator(early, 0.002)).velocity_ahead, 0.05);
  const Twin twin = TestTwin();
  EXPECT_LT(ErrorsOf(twin, Estimator(twin, 0.002), 0.3).velocity_ahead, 0.05);
}

TEST(Estimator, AWrongTwinStillFollowsTheAngles) {
  Twin heavy = TestTwin();
  heavy.plant.mass2 *= 1.2;
  heavy.plant.coulomb1 = 0;
  const Errors errors = ErrorsOf(TestTwin(), Estimator(heavy, 0.002));
  EXPECT_LT(errors.angle, 0.001);
  EXPECT_LT(errors.velocity, 0.2);
}

/// The largest error of zeros and friction after ten seconds, as a share of that at the beginning.
/// `push`: torque (N·m) on joint 2 in the last 80 ms of every second, unknown to the
/// estimator.
double LargestShare(Estimator& estimator, const Twin& session, double push = 0) {
  const auto errors = [&] {
    const Joints zero = estimator.zero(), friction = estimator.friction();
    return std::array{zero[0] - session.sensors.zero1, zero[1] - session.sensors.zero2,
                      friction[0] - session.plant.coulomb1, friction[1] - session.plant.coulomb2};
  };
  const auto first = errors();
  SimulatedMachine machine(session, {});
  Joints sent{};
  for (int k = 0; k < 5000; ++k) {
    const double time = k * 0.002;
    machine.Advance(time);
    machine.Command({sent[0], k % 500 < 460 ? 0 : push});
    const TimedReading reading{machine.Read(), time};
    estimator.Update(time, sent, &reading);
    sent = {0.4 * std::sin(5 * time), 0};
  }
  EXPECT_NEAR(estimator.now().q1 + estimator.zero()[0], machine.Read().angle[0], 0.001);
  double largest = 0;
  for (size_t i = 0; i < 4; ++i) largest = std::max(largest, std::abs(errors()[i] / first[i]));
  return largest;
}

TEST(Estimator, FindsTheZerosAndTheFrictionOfASession) {
  Twin twin = TestTwin(), session = twin;
  session.sensors.zero1 += 0.04;
  session.sensors.zero2 -= 0.03;
  session.plant.coulomb1 += 0.02;
  session.plant.coulomb2 -= 0.015;
  Estimator certain(twin, 0.002);
  EXPECT_EQ(LargestShare(certain, session), 1);

  twin.uncertain = {"zero1", "zero2", "coulomb1", "coulomb2"};
  twin.covariance.assign(16, 0);
  const std::array deviations{0.03, 0.03, 0.015, 0.015};
  for (size_t i = 0; i < 4; ++i) twin.covariance[5 * i] = deviations[i] * deviations[i];
  Estimator learns(twin, 0.002);
  EXPECT_LT(LargestShare(learns, session), 0.1);
  Estimator pushed(twin, 0.002);
  EXPECT_LT(LargestShare(pushed, session, 0.4), 0.4);  // 0.8 if pushes were not recognised

  // After a gap the state begins again, and the session stays known.
  const TimedReading later{{{0.5, 0.1}, {}}, 20};
  const Joints zero = learns.zero();
  learns.Update(20, {}, &later);
  EXPECT_EQ(learns.zero(), zero);
  EXPECT_NEAR(learns.now().q1, 0.5 - zero[0], 1e-9);
}

TEST(Estimator, FindsTheTorqueOffsetsOfASession) {
  Twin twin = TestTwin(), session = twin;
  session.actuator.torque_offset1 = 0.08;
  session.actuator.torque_offset2 = -0.05;
  twin.uncertain = {"zero1", "torque_offset1", "torque_offset2"};
  twin.covariance = {1e-4, 0, 0, 0, 0.01, 0, 0, 0, 0.01};
  Estimator estimator(twin, 0.002);
  SimulatedMachine machine(session, {});
  Joints sent{};
  for (int k = 0; k < 5000; ++k) {
    const double time = k * 0.002;
    machine.Advance(time);
    machine.Command(sent);
    const TimedReading reading{machine.Read(), time};
    estimator.Update(time, sent, &reading);
    sent = {0.4 * std::sin(5 * time), 0};
  }
  EXPECT_NEAR(estimator.offset()[0], 0.08, 0.01);
  EXPECT_NEAR(estimator.offset()[1], -0.05, 0.01);
  EXPECT_NEAR(estimator.zero()[0], twin.sensors.zero1, 0.005);
  // A compensation cancels them.
  const Joints none = Estimator(TestTwin(), 0.002).CompensationTorque(0.5);
  EXPECT_EQ(none, Joints{});
  Twin certain = session;
  EXPECT_EQ(Estimator(certain, 0.002).CompensationTorque(0.5), (Joints{-0.04, 0.025}));
}

/// Dry friction holds links away from where they hang, while a torque that cannot move them is
/// sent.
TEST(Estimator, LearnsLittleFromLinksThatStandUnderTorque) {
  Twin twin = TestTwin();
  twin.uncertain = {"zero1", "zero2"};
  twin.covariance = {9e-4, 0, 0, 9e-4};
  Estimator estimator(twin, 0.002);
  for (int k = 0; k < 5000; ++k) {
    const TimedReading held{{{0.07, -0.05}, {}}, 0.002 * k};
    estimator.Update(held.time, {0.02, 0}, &held);
  }
  EXPECT_NEAR(estimator.zero()[0], twin.sensors.zero1, 0.015);
  EXPECT_NEAR(estimator.zero()[1], twin.sensors.zero2, 0.015);
}

TEST(Estimator, AWrongReadingChangesTheVelocityLittle) {
  const Twin twin = TestTwin();
  Estimator estimator(twin, 0.002);
  for (int k = 0; k < 500; ++k) {
    const TimedReading reading{{{0.02 + (k == 499 ? 0.1 : 0), -0.01}, {}}, 0.002 * k};
    estimator.Update(reading.time, {1e-9, 0}, &reading);
  }
  EXPECT_NEAR(estimator.now().w1, 0, 0.5);  // 2.8 rad/s if it were taken as it is
}

TEST(Estimator, BeginsInFastMotion) {
  Twin twin = TestTwin();
  const PendulumState start{0, 0, 15, -18};
  SimulatedMachine machine(twin, start);
  Estimator estimator(twin, 0.002);
  for (int k = 0; k <= 20; ++k) {
    machine.Advance(0.002 * k);
    const TimedReading reading{machine.Read(), 0.002 * k};
    estimator.Update(reading.time, {}, &reading);
  }
  EXPECT_NEAR(estimator.now().w1, machine.state().w1, 0.2);
  EXPECT_NEAR(estimator.now().w2, machine.state().w2, 0.2);
}

TEST(Estimator, LearnsNothingAtRestNorFromReadingsThatAreNotNumbers) {
  Twin twin = TestTwin();
  twin.uncertain = {"zero1", "coulomb2"};
  twin.covariance = {9e-4, 0, 0, 2e-4};
  Estimator estimator(twin, 0.002);
  for (int k = 0; k < 1000; ++k) {  // dry friction holds the links away from where they hang
    const TimedReading held{{{0.07, -0.05}, {}}, 0.002 * k};
    estimator.Update(held.time, {}, &held);
  }
  EXPECT_EQ(estimator.zero()[0], twin.sensors.zero1);
  EXPECT_EQ(estimator.friction()[1], twin.plant.coulomb2);
  const TimedReading nothing{{{std::nan(""), 0}, {}}, 2};
  estimator.Update(2, {}, &nothing);
  EXPECT_NEAR(estimator.now().q1, 0.07 - twin.sensors.zero1, 0.002);
  // A clock that jumps back begins again.
  const TimedReading again{{{0.5, 0}, {}}, 0.1};
  estimator.Update(0.1, {}, &again);
  EXPECT_NEAR(estimator.now().q1, 0.5 - estimator.zero()[0], 1e-9);
}

/// The logs of the first `runs` runs of each of six real sessions.
std::vector<std::vector<MachineLog>> RealSessions(int runs) {
  std::vector<std::vector<MachineLog>> sessions;
  for (const char* name :
       {"swingup/acrobot-tvlqr-0", "swingup/pendubot-tvlqr-0", "swingup/acrobot-mcpilco-0",
        "swingup/pendubot-mcpilco-0", "pushed/acrobot-tvlqr-0", "pushed/pendubot-tvlqr-0"}) {
    std::vector<MachineLog>& logs = sessions.emplace_back();
    for (int run = 1; run <= runs; ++run) {
      logs.push_back(ReadLog(RealData() / "C.1" / Concat(name, run, ".csv.gz")).front());
    }
  }
  return sessions;
}

/// An estimator after a log. `each` sees it after each row.
Estimator Replay(const MachineLog& log, const Twin& twin,
                 const std::function<void(const Estimator&)>& each = {}) {
  const Joints limit = TorqueLimits(twin, ActuatedJoint(log, twin));
  Estimator estimator(twin, twin.loop.period);
  Joints sent{};
  for (int row = 0; row < log.rows(); ++row) {
    const TimedReading reading{{log.angle[row], {}}, log.time[row]};
    estimator.Update(log.time[row], sent, &reading);
    if (each) each(estimator);
    for (int j = 0; j < 2; ++j) sent[j] = std::clamp(log.commanded[row][j], -limit[j], limit[j]);
  }
  return estimator;
}

/// The twin with the zeros and the friction that an estimator finds over a log.
Twin FoundIn(const MachineLog& log, const Twin& twin) {
  const Estimator estimator = Replay(log, twin);
  Twin found = twin;
  found.sessions.clear();
  found.sensors.zero1 = estimator.zero()[0];
  found.sensors.zero2 = estimator.zero()[1];
  found.plant.coulomb1 = estimator.friction()[0];
  found.plant.coulomb2 = estimator.friction()[1];
  return found;
}

/// The values found in a run, those of the twin, and those identified for the session predict the
/// session's other runs: median errors over 1 s, rad. UPSWING_RUNS prints them, of five
/// runs instead of three.
TEST(Estimator, WhatARunTeachesPredictsTheNextRealRuns) {
  if (RealData().empty()) GTEST_SKIP() << "no measured data";
  const bool print = std::getenv("UPSWING_RUNS") != nullptr;
  const Twin twin = ReadTwin("realaigym-twin", "test");
  Twin general = twin;
  general.sessions.clear();
  using Errors = std::vector<std::vector<double>>;  // of the windows of each run
  Errors all_found, all_given, all_known;
  const auto add = [](Errors& all, const Errors& some) {
    all.insert(all.end(), some.begin(), some.end());
  };
  for (const std::vector<MachineLog>& logs : RealSessions(print ? 5 : 3)) {
    Errors found, given, known;
    for (const MachineLog& log : logs) {
      const Twin after = FoundIn(log, twin);
      for (const MachineLog& other : logs) {
        if (&other != &log) found.push_back(WindowErrors(other, after, 1, false));
      }
      given.push_back(WindowErrors(log, general, 1, false));
      known.push_back(WindowErrors(log, InSession(twin, log), 1, false));
    }
    if (print) {
      std::printf("%-28s found %.4f, twin %.4f, session %.4f rad\n",
                  SessionOf(logs[0].name).c_str(), PooledMedian(found), PooledMedian(given),
                  PooledMedian(known));
    }
    add(all_found, found);
    add(all_given, given);
    add(all_known, known);
  }
  if (print) {
    std::printf("all: found %.4f, twin %.4f, session %.4f rad\n", PooledMedian(all_found),
                PooledMedian(all_given), PooledMedian(all_known));
  }
  EXPECT_LT(PooledMedian(all_found), 0.9 * PooledMedian(all_given));
}

TEST(Estimator, KnowsTheEnergy) {
  const Twin twin = TestTwin();
  Estimator estimator(twin, 0.002);
  TimedReading reading{{{0.02, -0.01}, {}}, 0};  // the zeros: hanging
  estimator.Update(0, {}, &reading);
  EXPECT_NEAR(estimator.energy(), 0, 1e-9);
  Estimator upright(twin, 0.002);
  reading.angle[0] += 3.14159265358979;
  upright.Update(0, {}, &reading);
  EXPECT_NEAR(upright.energy(), 1, 1e-9);
}

}  // namespace
}  // namespace upswing::machine
