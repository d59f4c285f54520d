#include "extras/machine/logs/check.h"

#include <fmt/format.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <nlohmann/json.hpp>
#include <numbers>

#include "base/rng.h"
#include "extras/machine/twin/testing.h"
#include "pendulum/equations.h"
#include "pendulum/runge_kutta.h"

namespace upswing::machine {
namespace {

/// A log of 10 s at 500 Hz without faults: smooth motion, velocities of their own, and a measured
/// torque that is 0.95 times the command two rows before.
MachineLog GoodLog() {
  MachineLog log;
  log.name = "log.csv";
  Rng rng(1, "machine check test");
  for (int k = 0; k < 5000; ++k) {
    const double t = 0.002 * k;
    log.time.push_back(t);
    log.angle.push_back({1.2 * std::sin(3 * t) + 0.3 * std::sin(7.1 * t), 0.8 * std::sin(5 * t)});
    log.velocity.push_back({3.6 * std::cos(3 * t) + 2.13 * std::cos(7.1 * t) + 0.02 * rng.Normal(),
                            4 * std::cos(5 * t) + 0.02 * rng.Normal()});
    log.commanded.push_back({std::sin(11 * t) + std::sin(2 * t * t), std::cos(13 * t + t * t)});
    const Joints sent = log.commanded[std::max(0, k - 2)];
    log.measured.push_back(
        {0.95 * sent[0] + 0.01 * rng.Normal(), 0.95 * sent[1] + 0.01 * rng.Normal()});
  }
  return log;
}

/// The findings about a log.
Findings CheckAll(const MachineLog& log) {
  return CheckLog("log.csv", std::span(&log, 1)).findings;
}

/// The same without those of the equations of motion: the smooth motion of GoodLog is none of a
/// pendulum.
Findings Check(const MachineLog& log) {
  Findings findings = CheckAll(log);
  std::erase_if(findings, [](const Finding& finding) {
    return !finding.numbers.empty() && finding.numbers.front().first == "unexplained";
  });
  return findings;
}

/// A number of a finding by its name; -1 if it has none.
double NumberOf(const Finding& finding, const std::string& name) {
  for (const auto& [key, value] : finding.numbers) {
    if (key == name) return value;
  }
  return -1;
}

/// Checks a good log after a change. Expects a single fault or warning, with this text, and returns
/// it.
Finding OnlyFinding(const std::function<void(MachineLog&)>& change, const std::string& text,
                    Severity severity = Severity::kFault) {
  MachineLog log = GoodLog();
  change(log);
  Findings found = Check(log);
  std::erase_if(found, [](const Finding& f) { return f.severity == Severity::kNote; });
  EXPECT_EQ(found.size(), 1U);
  for (const Finding& f : found) EXPECT_NE(f.text.find(text), std::string::npos) << f.text;
  if (found.empty()) return {};
  EXPECT_EQ(found.front().severity, severity);
  return found.front();
}

/// A change of a quantity of one joint in all rows.
std::function<void(MachineLog&)> Times(std::vector<Joints> MachineLog::*values, int joint,
                                       double factor) {
  return [=](MachineLog& log) {
    for (Joints& row : log.*values) row[joint] *= factor;
  };
}

std::function<void(MachineLog&)> Swapped(std::vector<Joints> MachineLog::*values) {
  return [=](MachineLog& log) {
    for (Joints& row : log.*values) std::swap(row[0], row[1]);
  };
}

TEST(MachineCheck, AGoodLogHasOnlyNotes) {
  const Findings found = Check(GoodLog());
  for (const Finding& f : found) EXPECT_EQ(f.severity, Severity::kNote) << f.text;
  ASSERT_EQ(found.size(), 5U);  // the clock, two velocities, two torques
  EXPECT_EQ(found[0].text, "500 Hz, cycles of 2 ms (usual), 2 ms (99%), 2 ms (longest)");
  EXPECT_EQ(NumberOf(found[3], "delay_rows"), 2);
  EXPECT_EQ(NumberOf(found[3], "lag"), 0);
  EXPECT_NEAR(NumberOf(found[3], "gain"), 0.95, 0.001);
  EXPECT_NEAR(NumberOf(found[4], "correlation"), 1, 0.001);
}

TEST(MachineCheck, DelayLagAndGainOfTheTorque) {
  MachineLog log = GoodLog();
  double torque = log.commanded[0][0];
  for (int k = 0; k < log.rows(); ++k) {  // 3 rows, 5 ms, 0.8
    torque += (1 - std::exp(-0.002 / 0.005)) * (log.commanded[std::max(0, k - 3)][0] - torque);
    log.measured[k][0] = 0.8 * torque;
  }
  const Findings found = Check(log);
  EXPECT_EQ(found[3].text,
            "measured follows commanded after 3 rows and a lag of 5 ms, gain 0.80, correlation "
            "1.000: the motors give another torque than commanded (key factor of commanded)");
}

TEST(MachineCheck, LostCyclesAndGaps) {
  const auto skip = [](int rows) {
    return [rows](MachineLog& log) {
      for (int k = 1000; k < log.rows(); ++k) log.time[k] += 0.002 * rows;
    };
  };
  // Velocities follow the new clock only nearly, within the limits of the check.
  MachineLog log = GoodLog();
  skip(3)(log);
  EXPECT_EQ(Check(log)[1].text, "3 cycles (0.06%) lost at 1 place, longest 8 ms");
  const Finding gap = OnlyFinding(skip(100), "a gap of 0.202 s", Severity::kWarning);
  ASSERT_TRUE(gap.rows);
  EXPECT_EQ(gap.rows->first, 1000);  // rows count from 1
  EXPECT_EQ(gap.rows->last, 1001);
  EXPECT_NEAR(gap.rows->begin, 1.998, 1e-12);
  OnlyFinding(
      [](MachineLog& standing) {
        standing.time[7] = standing.time[6];
        standing.velocity.clear();
      },
      "stands still in 1 row", Severity::kWarning);
}

TEST(MachineCheck, ManyGapsGetALineTogether) {
  MachineLog log = GoodLog();
  for (int k = 0; k < log.rows(); ++k) log.time[k] += k / 200 / 2.0;  // 24 gaps
  const Findings found = Check(log);
  EXPECT_EQ(std::ranges::count(found, Severity::kWarning, &Finding::severity), 11);
  EXPECT_TRUE(std::ranges::count(found, "14 more gaps, the longest 0.502 s", &Finding::text) == 1);
  // A long one is a fault, and not less because of the others.
  for (int k = 4500; k < log.rows(); ++k) log.time[k] += 60;
  const Findings longer = Check(log);
  EXPECT_EQ(std::ranges::count(longer, Severity::kFault, &Finding::severity), 1);
}

TEST(MachineCheck, AClockThatIsSetAgainCostsNoTime) {
  for (const double jump : {1.7e9, 9e11}) {
    MachineLog log = GoodLog();
    for (int k = log.rows() / 2; k < log.rows(); ++k) log.time[k] += jump;
    const Findings found = Check(log);
    EXPECT_EQ(std::ranges::count(found, Severity::kFault, &Finding::severity), 1) << jump;
  }
}

TEST(MachineCheck, Clocks) {
  OnlyFinding(
      [](MachineLog& log) {
        for (double& t : log.time) t *= 1000;
        log.velocity.clear();
      },
      "suspect a clock in ms");
  OnlyFinding(
      [](MachineLog& log) {
        for (double& t : log.time) t *= 1e6;
        log.velocity.clear();
      },
      "suspect a clock in µs");
  OnlyFinding(
      [](MachineLog& log) {
        for (double& t : log.time) t /= 1e6;
        log.velocity.clear();
      },
      "makes the clock a million times too fast");
}

TEST(MachineCheck, VelocitiesTellOfAFastClock) {
  const Finding clock = OnlyFinding(
      [](MachineLog& log) {
        for (double& t : log.time) t /= 1.05;
      },
      "a clock that is 5% fast");
  EXPECT_EQ(clock.aspect, Aspect::kClock);
}

TEST(MachineCheck, OneWrongSample) {
  const Finding wrong =
      OnlyFinding([](MachineLog& log) { log.angle[2000][1] += 0.08; }, "a wrong sample");
  EXPECT_EQ(wrong.joint, 2);
  ASSERT_TRUE(wrong.rows);
  EXPECT_EQ(wrong.rows->last, 2001);
}

TEST(MachineCheck, UnitsAndSignOfVelocities) {
  const auto velocity = &MachineLog::velocity;
  EXPECT_EQ(OnlyFinding(Times(velocity, 0, -1), "opposite sign").joint, 1);
  EXPECT_EQ(OnlyFinding(Times(velocity, 1, 180 / std::numbers::pi), "velocities in deg/s").joint,
            2);
  OnlyFinding(Times(velocity, 1, 60 / (2 * std::numbers::pi)), "velocities in rpm");
  OnlyFinding(Times(velocity, 1, 6), "the unit or a gear");
  OnlyFinding(Times(velocity, 1, 1.2), "1.200 times", Severity::kWarning);
  OnlyFinding(
      [](MachineLog& log) {
        Rng rng(3, "noise");
        for (Joints& v : log.velocity) v[0] = rng.Normal();
      },
      "does not follow the angle", Severity::kWarning);
}

TEST(MachineCheck, DegreesOfAngles) {
  // With velocities in rad/s, the gain shows the fault; at these speeds the range does, too.
  MachineLog log = GoodLog();
  Times(&MachineLog::angle, 1, 180 / std::numbers::pi)(log);
  const Findings found = Check(log);
  const auto has = [&](const std::string& text) {
    return std::ranges::any_of(found, [&](const Finding& f) {
      return f.severity == Severity::kFault && f.joint == 2 &&
             f.text.find(text) != std::string::npos;
    });
  };
  EXPECT_TRUE(has("suspect angles in degrees"));
  EXPECT_TRUE(has("suspect degrees"));
  // Angles and velocities in degrees agree with each other.
  OnlyFinding(
      [](MachineLog& both) {
        Times(&MachineLog::angle, 1, 180 / std::numbers::pi)(both);
        Times(&MachineLog::velocity, 1, 180 / std::numbers::pi)(both);
      },
      "suspect degrees");
}

TEST(MachineCheck, SwappedColumns) {
  for (const auto values : {&MachineLog::velocity, &MachineLog::measured}) {
    MachineLog log = GoodLog();
    Swapped(values)(log);
    Findings found = Check(log);
    std::erase_if(found, [](const Finding& f) { return f.severity != Severity::kFault; });
    ASSERT_EQ(found.size(), 2U);
    for (const Finding& f : found) {
      EXPECT_NE(f.text.find("suspect swapped columns"), std::string::npos) << f.text;
      if (values != &MachineLog::measured) continue;
      // The numbers are of the response to the other joint's command.
      EXPECT_EQ(NumberOf(f, "delay_rows"), 2);
      EXPECT_NEAR(NumberOf(f, "gain"), 0.95, 0.001);
      EXPECT_NEAR(NumberOf(f, "correlation"), 1, 0.001);
    }
  }
}

TEST(MachineCheck, UnitsAndSignOfTorques) {
  OnlyFinding(Times(&MachineLog::measured, 0, 1000), "measured torque in mN·m");
  OnlyFinding(Times(&MachineLog::commanded, 0, 1000), "commanded torque in mN·m");
  OnlyFinding(Times(&MachineLog::measured, 1, 0.166), "the unit or a gear");
  OnlyFinding(Times(&MachineLog::measured, 1, -1), "opposite sign");
  OnlyFinding(Times(&MachineLog::measured, 1, 0), "never changes");
  OnlyFinding(
      [](MachineLog& log) {
        log.measured.clear();
        Times(&MachineLog::commanded, 1, 1000)(log);
      },
      "suspect mN·m if", Severity::kWarning);
}

TEST(MachineCheck, AmperesCommandsWithinOneAndSwappedTorques) {
  OnlyFinding(Times(&MachineLog::measured, 0, 0.57), "suspect one of them in amperes",
              Severity::kWarning);
  OnlyFinding(
      [](MachineLog& log) {
        log.measured.clear();
        for (Joints& u : log.commanded) u[0] = std::clamp(u[0], -1.0, 1.0);
      },
      "ends at 1 exactly", Severity::kWarning);
  MachineLog log = GoodLog();
  std::swap(log.commanded, log.measured);
  Findings found = Check(log);
  std::erase_if(found, [](const Finding& f) { return f.severity != Severity::kFault; });
  ASSERT_EQ(found.size(), 2U);
  for (const Finding& f : found) {
    EXPECT_EQ(f.text, "commanded follows measured after 2 rows: suspect swapped columns");
    EXPECT_EQ(NumberOf(f, "delay_rows"), 2);
    EXPECT_NEAR(NumberOf(f, "gain"), 0.95, 0.001);
    EXPECT_NEAR(NumberOf(f, "correlation"), 1, 0.001);
  }
}

TEST(MachineCheck, VelocitiesThatAreDifferences) {
  MachineLog log = GoodLog();
  for (int k = 1; k < log.rows(); ++k) {
    for (const int j : {0, 1}) {
      log.velocity[k][j] = (log.angle[k][j] - log.angle[k - 1][j]) / 0.002;
    }
  }
  const std::string text =
      "exactly the backward difference of the angle: no measurement of its own";
  EXPECT_EQ(Check(log)[1].text, text);
  EXPECT_EQ(Check(log)[2].text, text);
}

TEST(MachineCheck, QuantumOfTheEncoder) {
  MachineLog log = GoodLog();
  const double quantum = 2 * std::numbers::pi / 4096;
  for (Joints& q : log.angle) q[0] = quantum * std::round(q[0] / quantum);
  EXPECT_EQ(Check(log)[1].text, "steps of 0.00153 rad (4096 per turn)");
}

TEST(MachineCheck, StuckEncoder) {
  const Finding stuck = OnlyFinding(
      [](MachineLog& log) {
        for (int k = 2200; k < 2212; ++k) log.angle[k][1] = log.angle[2199][1];
      },
      "the encoder sticks");
  EXPECT_EQ(stuck.joint, 2);
  ASSERT_TRUE(stuck.rows);
  EXPECT_EQ(stuck.rows->first, 2200);
  EXPECT_EQ(stuck.rows->last, 2212);
  OnlyFinding(  // no pendulum with a joint moves like this
      [](MachineLog& log) {
        for (Joints& q : log.angle) q[1] = 0.25;
        log.velocity.clear();
      },
      "the encoder sticks at 0.25 rad: joint 1 moves as it does only if this joint moves");
}

TEST(MachineCheck, ACoarseEncoderDoesNotStick) {
  MachineLog log = GoodLog();
  log.velocity.clear();
  const double quantum = 2 * std::numbers::pi / 256;
  for (Joints& q : log.angle) {
    for (double& angle : q) angle = quantum * std::round(angle / quantum);
  }
  for (const Finding& f : Check(log)) EXPECT_EQ(f.severity, Severity::kNote) << f.text;
}

TEST(MachineCheck, SaturatedSensors) {
  const Finding angle = OnlyFinding(
      [](MachineLog& log) {  // turns on and on until the encoder's end
        log.velocity.clear();
        for (int k = 0; k < log.rows(); ++k) {
          const double t = log.time[k];
          log.angle[k][0] = std::min(12.5, 5 * t + 0.1 * std::sin(std::numbers::pi * t));
        }
      },
      "saturates at 12.5 rad");
  ASSERT_TRUE(angle.rows);
  EXPECT_NEAR(angle.rows->begin, 2.48, 0.1);
  EXPECT_EQ(angle.rows->last, 5000);
  const Finding velocity = OnlyFinding(
      [](MachineLog& log) {
        for (Joints& v : log.velocity) v[1] = std::clamp(v[1], -3.7, 3.7);
      },
      "saturates at 3.7 rad/s");
  EXPECT_EQ(velocity.aspect, Aspect::kVelocity);
}

TEST(MachineCheck, MotionThatGrowsWithoutTorque) {
  const auto swing = [](double growth) {
    return [growth](MachineLog& log) {
      log.velocity.clear();
      for (int k = 0; k < log.rows(); ++k) {
        const double t = log.time[k];
        log.angle[k] = {0.1 * std::exp(growth * t) * std::sin(5 * t),
                        0.05 * std::exp(growth * t) * std::sin(5 * t)};
        log.commanded[k] = log.measured[k] = {};
      }
    };
  };
  const Finding grown = OnlyFinding(swing(0.2), "without torque");
  ASSERT_TRUE(grown.rows);
  EXPECT_EQ(grown.rows->first, 1);
  EXPECT_EQ(grown.rows->last, 5000);
  MachineLog log = GoodLog();
  swing(-0.2)(log);
  for (const Finding& f : Check(log)) EXPECT_EQ(f.severity, Severity::kNote) << f.text;
  OnlyFinding(
      [&](MachineLog& unknown) {
        swing(0.2)(unknown);
        unknown.commanded.clear();
        unknown.measured.clear();
      },
      "the log has no torque", Severity::kWarning);
}

/// Torques at joint 1 that swing both links.
double SwingTorque(double t) { return 3 * std::sin(3 * t) + 2 * std::sin(7 * t); }

/// A log of a pendulum's equations of motion from a start, with torques at joint 1.
MachineLog Simulated(const PendulumState& start, const std::function<double(double)>& torque,
                     double seconds, const Plant& of = {}) {
  const Manipulator plant = ManipulatorOf(of);
  MachineLog log;
  PendulumState x = start;
  for (int k = 0; k < seconds * 500; ++k) {
    const double t = 0.002 * k;
    log.time.push_back(t);
    log.angle.push_back({x.q1, x.q2});
    log.commanded.push_back({torque(t), 0});
    const auto acceleration = [&](const PendulumState& s, double share) {
      return plant.Acceleration(s, {torque(t + 0.002 * share), 0});
    };
    x = RungeKuttaStep(x, acceleration(x, 0), 0.002, acceleration);
  }
  return log;
}

TEST(MachineCheck, SignsByTheEquationsOfMotion) {
  const auto push = [](double t) { return 3 * std::sin(3 * t) + 2 * std::sin(7 * t); };
  const auto change = [&](double angle1, double angle2, double torque) {
    MachineLog log = Simulated({}, push, 10);
    for (Joints& q : log.angle) q = {angle1 * q[0], angle2 * q[1]};
    for (Joints& u : log.commanded) u[0] *= torque;
    Findings found = CheckAll(log);
    std::erase_if(found, [](const Finding& f) { return f.severity == Severity::kNote; });
    return found;
  };
  EXPECT_TRUE(change(1, 1, 1).empty());
  EXPECT_TRUE(change(-1, -1, -1).empty());  // the mirror image
  ASSERT_EQ(change(1, -1, 1).size(), 1U);
  EXPECT_EQ(AboutText(change(1, -1, 1)[0]), "angle 2");
  EXPECT_EQ(AboutText(change(-1, 1, 1)[0]), "angle 1");
  ASSERT_EQ(change(1, 1, -1).size(), 1U);
  EXPECT_EQ(AboutText(change(1, 1, -1)[0]), "torque 1");
}

/// The faults of a log by their aspects and joints.
std::string FaultsOf(const MachineLog& log) {
  std::string faults;
  for (const Finding& f : CheckAll(log)) {
    if (f.severity == Severity::kFault) faults += AboutText(f) + ": " + f.text + "\n";
  }
  return faults;
}

TEST(MachineCheck, TheEquationsOfMotionNameEachChangeOfTheColumns) {
  constexpr double kPi = std::numbers::pi;
  const MachineLog good = Simulated(
      {}, [](double t) { return 4 * std::sin(3 * t) + 3 * std::sin(7 * t); }, 10);
  EXPECT_EQ(FaultsOf(good), "");
  const auto expect = [&](const std::function<void(Joints & q, Joints & u)>& change,
                          const std::vector<std::string>& texts) {
    MachineLog log = good;
    for (int k = 0; k < log.rows(); ++k) change(log.angle[k], log.commanded[k]);
    for (const bool measured : {false, true}) {
      if (measured) std::swap(log.measured, log.commanded);  // which is empty from then on
      const std::string faults = FaultsOf(log);
      for (const auto& text : texts) EXPECT_NE(faults.find(text), std::string::npos) << faults;
      EXPECT_EQ(std::ranges::count(faults, '\n'), std::ssize(texts)) << faults;
    }
  };
  expect([](Joints& q, Joints&) { q[0] += kPi; }, {"angle 1: suspect another zero"});
  expect([](Joints& q, Joints&) { q[0] += 0.8; }, {"angle 1: suspect another zero, 0.80"});
  expect([](Joints& q, Joints&) { q[1] -= 1; }, {"angle 2: suspect another zero, -1.0"});
  expect([](Joints& q, Joints&) { q[1] += q[0]; },
         {"angle 2: suspect an angle against the vertical"});
  expect([](Joints& q, Joints&) { q[1] -= q[0]; }, {"angle 2: suspect an angle against link 1"});
  expect(
      [](Joints& q, Joints&) {
        q[1] += q[0] + kPi;
        q[0] += kPi;
      },
      {"against the vertical", "angle 1: suspect another zero"});
  expect(
      [](Joints& q, Joints&) {
        q = {q[0] / (2 * kPi), q[1] / (2 * kPi)};
      },
      {"angle 1: suspect turns", "angle 2: suspect turns"});
  expect(
      [](Joints& q, Joints& u) {
        std::swap(q[0], q[1]);
        std::swap(u[0], u[1]);
      },
      {"swapped columns of both joints"});
  expect([](Joints& q, Joints&) { std::swap(q[0], q[1]); }, {"swapped angles"});
  expect([](Joints&, Joints& u) { std::swap(u[0], u[1]); }, {"swapped torques"});
  expect([](Joints&, Joints& u) { u[0] = -u[0]; }, {"torque 1: suspect the opposite sign"});
}

/// Each `stride`-th row of a log, with angles in steps of an encoder.
MachineLog Sampled(const MachineLog& log, int stride, double counts) {
  const double step = 2 * std::numbers::pi / counts;
  MachineLog sampled;
  for (int k = 0; k < log.rows(); k += stride) {
    const Joints& q = log.angle[k];
    sampled.time.push_back(log.time[k]);
    sampled.angle.push_back({step * std::round(q[0] / step), step * std::round(q[1] / step)});
    if (!log.commanded.empty()) sampled.commanded.push_back(log.commanded[k]);
  }
  return sampled;
}

TEST(MachineCheck, AMachineThatTurnsRoundHasNoFaultAndHidesNone) {
  const MachineLog exact = Simulated({0, 0, 25, -12}, SwingTorque, 12);
  ASSERT_GT(AngleRange(std::span(&exact, 1), 1), 9);
  MachineLog slow;  // 50 Hz, without noise
  for (int k = 0; k < exact.rows(); k += 10) {
    slow.time.push_back(exact.time[k]);
    slow.angle.push_back(exact.angle[k]);
    slow.commanded.push_back(exact.commanded[k]);
  }
  EXPECT_EQ(FaultsOf(exact), "");
  EXPECT_EQ(FaultsOf(slow), "");
  // Nothing is known of the motion between rows that are 1 rad apart.
  Plant light;
  light.mass1 = light.mass2 = 0.5;
  light.length1 = 0.2;
  light.length2 = 0.3;
  light.damping1 = light.damping2 = 0.005;
  const MachineLog coarse = Sampled(Simulated({0, 0, 12, 20}, SwingTorque, 12, light), 30, 1 << 20);
  EXPECT_EQ(FaultsOf(coarse), "");
  EXPECT_TRUE(std::ranges::any_of(CheckAll(coarse), [](const Finding& f) {
    return f.text.find("the rows are too far apart") != std::string::npos;
  }));
  const auto faults_after = [&](const std::function<void(Joints & q, double share)>& change) {
    MachineLog log = exact;
    for (int k = 0; k < log.rows(); ++k) change(log.angle[k], k / double(log.rows()));
    return FaultsOf(log);
  };
  EXPECT_NE(faults_after([](Joints& q, double) {
              q[1] *= 0.9;
            }).find("angle 2: suspect an angle of 0.9 times"),
            std::string::npos);
  EXPECT_NE(faults_after([](Joints& q, double share) {
              q[0] += share > 0.47 ? 0.1 : 0;
            }).find("angle 1: suspect an encoder that slips by 0.1 rad"),
            std::string::npos);
}

TEST(MachineCheck, OneMotorOfTwoIsOff) {
  MachineLog log = Simulated({}, SwingTorque, 12);
  for (int k = 0; k < log.rows(); ++k) log.commanded[k][1] = 2 * std::sin(5 * log.time[k]);
  const std::string faults = FaultsOf(log);
  EXPECT_NE(faults.find("torque 2: the commanded torques have no effect"), std::string::npos)
      << faults;
  EXPECT_EQ(faults.find("torque 1"), std::string::npos) << faults;
}

TEST(MachineCheck, LostRowsThatTheClockShowsAreNoFault) {
  const MachineLog exact = Simulated({}, SwingTorque, 12);
  MachineLog log;
  Rng rng(5, "lost rows");
  for (int k = 0; k < exact.rows(); ++k) {
    if (rng.Uniform() < 0.008) continue;
    log.time.push_back(exact.time[k]);
    log.angle.push_back(exact.angle[k]);
    log.commanded.push_back(exact.commanded[k]);
  }
  EXPECT_EQ(FaultsOf(log), "");
}

/// Damages a log: a tenth of the rows is lost, and the clock counts on.
void LoseRows(MachineLog& log) {
  const MachineLog all = log;
  Rng rng(7, "lost rows");
  log.angle.clear();
  log.commanded.clear();
  for (int k = 0; k < all.rows(); ++k) {
    if (rng.Uniform() < 0.1) continue;
    log.angle.push_back(all.angle[k]);
    log.commanded.push_back(all.commanded[k]);
  }
  log.time.resize(log.angle.size());
}

TEST(MachineCheck, AFreeSwingMayHaveACoarseEncoderAndNoTorques) {
  Plant plant;
  plant.mass1 = plant.mass2 = 1.2;
  plant.damping1 = plant.damping2 = 0.03;
  for (const PendulumState& start : {PendulumState{-0.1, 1.4, 0, 0},
                                     {0.1, -2.3, 0, 0},
                                     {0.6, -1.9, 0, 0},
                                     {-0.7, -0.4, 0, 0},
                                     {2.8, -1, 0, 0}}) {
    plant.length1 = plant.length2 = start.q1 > 0 ? 0.2 : 0.4;
    const MachineLog exact = Simulated(
        start, [](double) { return 0; }, 10, plant);
    for (const double counts : {16384, 2048, 1024}) {
      MachineLog log = exact;
      log.commanded.clear();
      const double step = 2 * std::numbers::pi / counts;
      for (Joints& q : log.angle) {
        q = {step * std::round(q[0] / step), step * std::round(q[1] / step)};
      }
      EXPECT_EQ(FaultsOf(log), "") << start.q1 << " rad, " << counts << " counts";
    }
  }
}

TEST(MachineCheck, AMotorWithoutTorquesInTheLogIsAFault) {
  MachineLog log = Simulated(
      {1, -0.5, 0, 0}, [](double t) { return 3 * std::sin(3 * t) + 2 * std::sin(7 * t); }, 10);
  EXPECT_EQ(FaultsOf(log), "");
  log.commanded.clear();
  EXPECT_NE(FaultsOf(log).find("the log has no torque"), std::string::npos);
}

TEST(MachineCheck, PiecesAreNotJoined) {
  MachineLog whole = Simulated({}, SwingTorque, 10);
  std::vector<MachineLog> pieces(2, whole);
  pieces[1].first_row = 5001;
  const LogCheck check = CheckLog("two.csv", pieces);
  EXPECT_EQ(check.rows, 10000);
  EXPECT_NEAR(check.seconds, 2 * 9.998, 1e-9);
  EXPECT_FALSE(check.faulty());
  for (const Finding& f : check.findings) EXPECT_EQ(f.severity, Severity::kNote) << f.text;
  for (int k = 1000; k < 5000; ++k) pieces[1].time[k] += 3;
  const LogCheck gap = CheckLog("two.csv", pieces);
  EXPECT_TRUE(gap.faulty());
  const auto json = nlohmann::json::parse(CheckJson(std::span(&gap, 1)));
  const auto& log = json["logs"][0];
  EXPECT_EQ(log["pieces"], 2);
  EXPECT_EQ(log["faulty"], true);
  const auto& findings = log["findings"];
  const auto fault = std::ranges::find_if(
      findings, [](const auto& finding) { return finding["severity"] == "fault"; });
  ASSERT_NE(fault, findings.end());
  EXPECT_EQ((*fault)["rows"], (std::vector<int>{6000, 6001}));
  EXPECT_EQ((*fault)["aspect"], "clock");
}

/// A log of 30 swings of a machine like the default plant, of another size, driven at joint 1. The
/// masses grow with the cube of the length. `torque` changes the command at a share of the log.
MachineLog OfSize(double length, const std::function<double(double u, double share)>& torque,
                  double seconds = 8) {
  const double mass = std::pow(length, 3), time = std::sqrt(length);
  const double unit = mass * length;  // of a torque
  Plant plant;
  plant.mass1 *= mass;
  plant.mass2 *= mass;
  plant.length1 *= length;
  plant.length2 *= length;
  plant.damping1 *= unit * time;
  plant.damping2 *= unit * time;
  plant.armature *= unit * time * time;
  const Manipulator m = ManipulatorOf(plant);
  MachineLog log;
  PendulumState x;
  const double h = 0.002 * time;
  for (int k = 0; k < seconds * 500; ++k) {
    const double t = 0.002 * k, u = unit * SwingTorque(t);
    log.time.push_back(k * h);
    log.angle.push_back({x.q1, x.q2});
    log.commanded.push_back({u, 0});
    // The command of a row is sent while the angles of the next one are read.
    const double before = k > 1 ? log.commanded[k - 2][0] : 0;
    const double acts = unit * torque(before / unit, t / seconds);
    const auto acceleration = [&](const PendulumState& s, double) {
      return m.Acceleration(s, {acts, 0});
    };
    x = RungeKuttaStep(x, acceleration(x, 0), h, acceleration);
  }
  return log;
}

double AsCommanded(double u, double) { return u; }

TEST(MachineCheck, AGoodLogHasNoFaultWhateverItsSizeRateEncoderAndDigits) {
  for (const double length : {0.1, 4.0}) {
    const MachineLog exact = OfSize(length, AsCommanded);
    for (const int stride : {1, 10}) {
      for (const double counts : {512, 2400, 65536}) {
        for (const int digits : {3, 9}) {
          MachineLog log = Sampled(exact, stride, counts);
          const double unit = std::pow(10, -digits);
          for (Joints& q : log.angle) {
            q = {unit * std::round(q[0] / unit), unit * std::round(q[1] / unit)};
          }
          EXPECT_EQ(FaultsOf(log), "") << length << " times, every " << stride << "th row, "
                                       << counts << " counts, " << digits << " digits";
        }
      }
    }
  }
}

TEST(MachineCheck, FaultsOfTheWiringAreNamedForEachSize) {
  using Change = std::function<void(MachineLog&)>;
  const auto each = [](const std::function<void(Joints & q, double share)>& change) {
    return [change](MachineLog& log) {
      for (int k = 0; k < log.rows(); ++k) change(log.angle[k], k / double(log.rows()));
    };
  };
  // Shifts a column by rows: the values come later.
  const auto delay = [](std::vector<Joints> MachineLog::*column, int joint, int rows) {
    return [=](MachineLog& log) {
      for (int k = log.rows() - 1; k >= 0; --k) {
        (log.*column)[k][joint] = (log.*column)[std::max(0, k - rows)][joint];
      }
    };
  };
  struct Fault {
    const char* text;
    Change change;
    std::function<double(double u, double share)> torque = AsCommanded;
  };
  const std::vector<Fault> faults{
      {"angle 2: suspect an angle of 2 times the true one",
       each([](Joints& q, double) { q[1] *= 2; })},
      {"angle 1: suspect an angle of 2 times the true one",
       each([](Joints& q, double) { q[0] *= 2; })},
      {"angle 2: suspect an angle of 0.5 times the true one",
       each([](Joints& q, double) { q[1] /= 2; })},
      {"angle 2: suspect an angle of 3 times the true one",
       each([](Joints& q, double) { q[1] *= 3; })},
      // From 0.895 to 0.905 the equations leave less than they can tell.
      {"angle 2: suspect an angle of 0.", each([](Joints& q, double) { q[1] *= 0.9; })},
      {"angle 2: suspect angles that are", delay(&MachineLog::angle, 1, 12)},
      {"later than they act", delay(&MachineLog::commanded, 0, 30)},
      {"angle 2: suspect an encoder that slips",
       each([](Joints& q, double share) { q[1] += share > 0.55 ? 0.1 : 0; })},
      {"angle 2: suspect an encoder that drifts",
       each([](Joints& q, double share) { q[1] += 0.4 * share; })},
      {"angle 1: suspect an encoder that drifts",
       each([](Joints& q, double share) { q[0] -= 0.8 * share; })},
      {"torque 1: suspect an offset", [](MachineLog&) {}, [](double u, double) { return u + 0.4; }},
      {"motors that saturate near", [](MachineLog&) {},
       [](double u, double) { return std::clamp(u, -1.6, 1.6); }},
      {"a dead band", [](MachineLog&) {},
       [](double u, double) { return std::copysign(std::max(0.0, std::abs(u) - 1.5), u); }},
      {"a dead band", [](MachineLog&) {},
       [](double u, double) { return std::abs(u) < 0.9 ? 0 : u; }},
      {"a sign that turns near", [](MachineLog&) {},
       [](double u, double share) { return share > 0.5 ? -u : u; }},
      {"clock: suspect a clock that runs",
       [](MachineLog& log) {
         const double middle = log.time[log.rows() / 2];
         for (double& t : log.time) t += 0.1 * std::max(0.0, t - middle);
       }},
      {"rows are lost, but the clock counts on", LoseRows}};
  for (const double length : {0.1, 4.0}) {
    for (const Fault& fault : faults) {
      MachineLog log = Sampled(OfSize(length, fault.torque), 1, 8192);
      fault.change(log);
      const std::string found = FaultsOf(log);
      EXPECT_NE(found.find(fault.text), std::string::npos)
          << length << " times, " << fault.text << ":\n"
          << found;
    }
  }
}

TEST(MachineCheck, LostRowsAreNamedAtSlowRatesAndWithCoarseEncoders) {
  const MachineLog exact = OfSize(1, AsCommanded, 30);
  for (const MachineLog& right : {Sampled(exact, 20, 1 << 20), Sampled(exact, 2, 1024)}) {
    EXPECT_EQ(FaultsOf(right), "");
    MachineLog log = right;
    LoseRows(log);
    const std::string faults = FaultsOf(log);
    EXPECT_NE(faults.find("rows are lost, but the clock counts on"), std::string::npos)
        << right.rows() << " rows:\n"
        << faults;
  }
  // Angles in steps that a cycle does not pass.
  EXPECT_EQ(FaultsOf(Sampled(exact, 1, 512)), "");
}

TEST(MachineCheck, RowsThatAreThereTwiceAreNamedWhereTheClockCountsOn) {
  const MachineLog right = Sampled(OfSize(1, AsCommanded), 4, 8192);
  MachineLog log;
  Rng rng(8, "double rows");
  for (int k = 0; k < right.rows(); ++k) {
    const int times = rng.Uniform() < 0.1 ? 2 : 1;
    for (int i = 0; i < times; ++i) {
      log.angle.push_back(right.angle[k]);
      log.commanded.push_back(right.commanded[k]);
      log.time.push_back((right.time[1] - right.time[0]) * static_cast<double>(log.time.size()));
    }
  }
  const std::string faults = FaultsOf(log);
  EXPECT_NE(faults.find("rows are duplicates, but the clock counts on"), std::string::npos)
      << faults;
}

TEST(MachineCheck, ASensorThatIsSlowerThanTheLogIsAWarning) {
  const MachineLog right = Sampled(OfSize(1, AsCommanded), 4, 8192);
  MachineLog held = right;
  for (int k = 0; k < held.rows(); ++k) held.angle[k] = right.angle[k - k % 3];
  const auto warnings = [](const MachineLog& log) {
    return std::ranges::count_if(CheckAll(log), [](const Finding& f) {
      return f.severity == Severity::kWarning &&
             f.text.starts_with("each reading stands in 3 rows");
    });
  };
  EXPECT_EQ(warnings(held), 2);
  EXPECT_EQ(warnings(right), 0);
  EXPECT_EQ(FaultsOf(held).find("duplicates"), std::string::npos) << FaultsOf(held);
}

TEST(MachineCheck, AFactorOfAColumnWithAbsoluteAnglesIsNamed) {
  for (const double length : {0.1, 4.0}) {
    MachineLog exact = Sampled(OfSize(length, AsCommanded), 1, 8192);
    exact.absolute = true;
    EXPECT_EQ(FaultsOf(exact), "");
    for (const double factor : {2.0, 0.5}) {
      for (const Joints& factors : {Joints{factor, 1}, {1, factor}, {factor, factor}}) {
        MachineLog log = exact;
        for (Joints& q : log.angle) {
          const double absolute = factors[1] * (q[0] + q[1]);
          q[0] *= factors[0];
          q[1] = absolute - q[0];
        }
        const std::string found = FaultsOf(log);
        for (const int j : {0, 1}) {
          const std::string text =
              fmt::format("angle {}: suspect an angle of {:g} times", j + 1, factor);
          EXPECT_EQ(found.find(text) != std::string::npos, factors[j] != 1)
              << length << " times, factors " << factors[0] << ", " << factors[1] << ":\n"
              << found;
        }
      }
    }
  }
}

TEST(MachineCheck, NothingMoves) {
  MachineLog log = GoodLog();
  log.velocity.clear();
  log.measured.clear();
  const double step = 2 * std::numbers::pi / 4096;
  for (int k = 0; k < log.rows(); ++k) log.angle[k] = {0.5 + step * (k / 700 % 3), -step * (k % 2)};
  EXPECT_NE(FaultsOf(log).find("motion: nothing moves: both angles stay within 0.0031 rad, a few "
                               "steps of the encoders although the torques change by"),
            std::string::npos)
      << FaultsOf(log);
  log.commanded.clear();
  for (const bool is_constant : {false, true}) {
    if (is_constant) std::ranges::fill(log.angle, Joints{0.5, 0});
    const Findings found = Check(log);
    const auto finding = std::ranges::find(found, Aspect::kMotion, &Finding::aspect);
    ASSERT_NE(finding, found.end());
    EXPECT_EQ(finding->severity, Severity::kWarning);
    EXPECT_EQ(finding->text.find("nothing moves: "), 0U) << finding->text;
    EXPECT_NE(finding->text.find("the log says nothing about the machine"), std::string::npos);
  }
}

TEST(MachineCheck, MotorsThatAreOffHaveNoEffect) {
  MachineLog log = Simulated(
      {1.5, -0.5, 0, 0}, [](double) { return 0; }, 8);
  for (int k = 0; k < log.rows(); ++k) log.commanded[k] = {SwingTorque(log.time[k]), 0};
  EXPECT_NE(FaultsOf(log).find("no effect on the motion"), std::string::npos) << FaultsOf(log);
}

/// The first row after `time` (s) at which a joint turns round: an encoder that sticks from there
/// on makes no jump.
int TurningRow(const MachineLog& log, double time, int joint) {
  int k = 2;
  while (log.time[k] < time || (log.angle[k + 1][joint] - log.angle[k][joint]) *
                                       (log.angle[k][joint] - log.angle[k - 1][joint]) >
                                   0) {
    ++k;
  }
  return k;
}

/// Lets the encoders of joints stick from row `first` to before row `last`.
void Freeze(MachineLog& log, const std::vector<int>& joints, int first, int last) {
  for (int k = first; k < last; ++k) {
    for (const int joint : joints) log.angle[k][joint] = log.angle[first][joint];
  }
}

TEST(MachineCheck, AnEncoderThatFreezesWhereItsJointTurnsRound) {
  const MachineLog exact = Simulated({}, SwingTorque, 12);
  for (const int stride : {1, 5, 10}) {  // 500, 100 and 50 Hz
    for (const double counts : {16384, 1000}) {
      const MachineLog good = Sampled(exact, stride, counts);
      EXPECT_EQ(FaultsOf(good), "");
      for (const int joint : {0, 1}) {
        const int turn = TurningRow(good, 5, joint), second = 500 / stride;
        const std::string expected = fmt::format("angle {}: the encoder sticks at {:.4g} rad",
                                                 joint + 1, good.angle[turn][joint]);
        for (const int last : {good.rows(), turn + 3 * second}) {
          MachineLog log = good;
          Freeze(log, {joint}, turn, last);
          EXPECT_NE(FaultsOf(log).find(expected), std::string::npos)
              << stride << " rows, " << counts << " counts, until row " << last << "\n"
              << FaultsOf(log);
        }
        MachineLog log = good;  // from the beginning on
        Freeze(log, {joint}, 0, good.rows());
        EXPECT_NE(FaultsOf(log).find("the encoder sticks at 0 rad"), std::string::npos);
      }
    }
  }
}

TEST(MachineCheck, TheSizeOfTheMachineChangesNoVerdictOnAnEncoder) {
  for (const double scale : {0.001, 1000.0}) {
    Plant plant;
    plant.mass1 *= scale;
    plant.mass2 *= scale;
    plant.damping1 *= scale;
    plant.damping2 *= scale;
    plant.armature *= scale;
    MachineLog log = Sampled(Simulated(
                                 {}, [&](double t) { return scale * SwingTorque(t); }, 10, plant),
                             1, 4096);
    EXPECT_EQ(FaultsOf(log).find("encoder"), std::string::npos);
    Freeze(log, {1}, TurningRow(log, 5, 1), log.rows());
    EXPECT_NE(FaultsOf(log).find("angle 2: the encoder sticks"), std::string::npos)
        << scale << "\n"
        << FaultsOf(log);
  }
}

/// A log as of Simulated in which something holds a joint from `held_from` (s) on.
MachineLog WithHeldJoint(int joint, double held_from, double seconds) {
  MachineLog log = Simulated({}, SwingTorque, held_from);
  const Manipulator plant = ManipulatorOf(Plant{});
  const Joints last = log.angle.back(), before = log.angle[log.rows() - 2];
  double w = (last[1 - joint] - before[1 - joint]) / 0.002, q = last[1 - joint];
  for (int k = log.rows(); k < seconds * 500; ++k) {
    const double t = 0.002 * k;
    constexpr int kSteps = 20;
    for (int i = 0; i < kSteps; ++i) {  // Euler's method
      const PendulumState s =
          joint == 0 ? PendulumState{last[0], q, 0, w} : PendulumState{q, last[1], w, 0};
      const ManipulatorTerms terms = plant.At(s);
      const double force = joint == 0 ? -terms.h2 : SwingTorque(t) - terms.h1;
      w += 0.002 / kSteps * force / (joint == 0 ? terms.M22 : terms.M11);
      q += 0.002 / kSteps * w;
    }
    log.time.push_back(t);
    log.angle.push_back(joint == 0 ? Joints{last[0], q} : Joints{q, last[1]});
    log.commanded.push_back({SwingTorque(t), 0});
  }
  return log;
}

TEST(MachineCheck, AHeldJointIsNoStuckEncoder) {
  for (const int joint : {0, 1}) {
    for (const double held_from : {0.0, 5.0}) {
      const MachineLog exact = WithHeldJoint(joint, std::max(held_from, 0.004), held_from + 6);
      for (const int stride : {1, 5}) {
        for (const double counts : {16384, 1000}) {
          const std::string faults = FaultsOf(Sampled(exact, stride, counts));
          EXPECT_EQ(faults.find("sticks"), std::string::npos)
              << "joint " << joint + 1 << ", " << counts << " counts\n"
              << faults;
        }
      }
    }
  }
}

TEST(MachineCheck, BothEncodersFreeze) {
  MachineLog log = Sampled(Simulated({}, SwingTorque, 12), 1, 4096);
  Freeze(log, {0, 1}, TurningRow(log, 5, 0), log.rows());
  EXPECT_NE(FaultsOf(log).find("angle 1: the encoder sticks"), std::string::npos) << FaultsOf(log);
  // Only the measured torque tells.
  std::swap(log.commanded, log.measured);
  EXPECT_NE(FaultsOf(log).find("angle 1: the encoder sticks"), std::string::npos) << FaultsOf(log);

  Freeze(log, {0, 1}, 0, log.rows());
  EXPECT_EQ(FaultsOf(log).find("motion: nothing moves: no angle ever changes although the "
                               "torques change by"),
            0U);
  // Links hang, and the measured torque has noise.
  Rng rng(4, "noise");
  for (Joints& u : log.measured) u = {0.01 * rng.Normal(), 0.01 * rng.Normal()};
  EXPECT_EQ(FaultsOf(log), "");
}

TEST(MachineCheck, LinksThatComeToRestAreNoStuckEncoders) {
  Plant plant;
  plant.damping1 = plant.damping2 = 1;
  const auto ends = [](double t) { return t < 6 ? SwingTorque(t) : 0.0; };
  MachineLog log = Sampled(Simulated({}, ends, 16, plant), 1, 2048);
  EXPECT_EQ(FaultsOf(log), "");
}

TEST(MachineCheck, ARowThatComesEarlyIsNoStuckEncoder) {
  MachineLog log = GoodLog();
  log.velocity.clear();
  // Dry friction holds joint 2 for ten rows after a late row and an early one.
  const double step = 2 * std::numbers::pi / 16384;
  for (Joints& q : log.angle) q[1] = step * std::round(q[1] / step / 100);
  const int k = 2200;
  log.time[k] = log.time[k + 1] - 1e-5;
  for (int i = k + 1; i < k + 11; ++i) log.angle[i][1] = log.angle[k][1] + step;
  EXPECT_EQ(FaultsOf(log).find("sticks"), std::string::npos) << FaultsOf(log);
}

TEST(MachineCheck, AMotorThatOnlyBrakesAtTheEnd) {
  MachineLog log = Simulated({}, SwingTorque, 10);
  // Motor 2 reports the torque that accelerates its rotor. At the end it brakes.
  const auto acceleration = [&](int k) {
    return (log.angle[k + 1][1] - 2 * log.angle[k][1] + log.angle[k - 1][1]) / 4e-6;
  };
  log.measured = log.commanded;
  for (int k = 1; k + 1 < log.rows(); ++k) log.measured[k][1] = -0.003 * acceleration(k);
  EXPECT_EQ(FaultsOf(log), "");
  for (int k = log.rows() - 100; k + 1 < log.rows(); ++k) {
    log.commanded[k][1] = -0.1 * (log.angle[k][1] - log.angle[k - 1][1]) / 0.002;
    log.measured[k][1] += log.commanded[k - 2][1];
  }
  EXPECT_EQ(FaultsOf(log), "");
}

TEST(MachineCheck, TorquesOfZeros) {
  const MachineLog good = Simulated({1, -0.5, 0, 0}, SwingTorque, 10);
  const std::string text = "torque: all torques of the motors are 0, but no free pendulum moves";
  MachineLog log = good;
  for (Joints& u : log.commanded) u = {};
  EXPECT_EQ(FaultsOf(log).find(text), 0U) << FaultsOf(log);
  log.measured = good.commanded;
  EXPECT_NE(FaultsOf(log), "");
  log.measured = log.commanded;
  EXPECT_EQ(FaultsOf(log).find(text), 0U) << FaultsOf(log);
  log.commanded = good.commanded;
  EXPECT_NE(FaultsOf(log).find("torque 1: measured torque never changes"), std::string::npos);
  MachineLog swing = Simulated(
      {1, -0.5, 0, 0}, [](double) { return 0; }, 10);
  EXPECT_EQ(FaultsOf(swing), "");
}

TEST(MachineCheck, WrappedAnglesWrongSamplesAndSlips) {
  const auto turns = [](MachineLog& log) {
    log.velocity.clear();
    for (int k = 0; k < log.rows(); ++k) log.angle[k][0] = 4 * log.time[k] + std::sin(log.time[k]);
  };
  MachineLog smooth = GoodLog();
  turns(smooth);
  for (const Finding& f : Check(smooth)) EXPECT_EQ(f.severity, Severity::kNote) << f.text;
  const Finding wrapped = OnlyFinding(
      [&](MachineLog& log) {
        turns(log);
        for (Joints& q : log.angle) q[0] = std::remainder(q[0], 2 * std::numbers::pi);
      },
      "suspect a wrapped angle");
  EXPECT_EQ(wrapped.joint, 1);
  const Finding wrong = OnlyFinding(
      [&](MachineLog& log) {
        turns(log);
        log.angle[3000][0] = 0;
      },
      "a wrong sample: 0 rad after 23.");
  EXPECT_EQ(wrong.rows->first, 3000);
  OnlyFinding(
      [&](MachineLog& log) {
        turns(log);
        for (int k = 2000; k < log.rows(); ++k) log.angle[k][0] += 0.5;
      },
      "jumps by 0.5");
}

TEST(MachineCheck, RestWhereGravityMovesALink) {
  const auto rest = [](double q1, double q2, Severity severity) {
    MachineLog log = Simulated(
        {}, [](double t) { return t < 1 ? 0 : 2 * std::sin(4 * t); }, 5);
    for (Joints& q : log.angle) q = {q[0] + q1, q[1] + q2};
    Findings found = Check(log);
    std::erase_if(found, [](const Finding& f) { return f.severity == Severity::kNote; });
    ASSERT_FALSE(found.empty());
    EXPECT_NE(found[0].text.find("another zero"), std::string::npos) << found[0].text;
    EXPECT_EQ(found[0].severity, severity);
  };
  rest(-std::numbers::pi / 2, 0, Severity::kFault);  // from the horizontal
  rest(-std::numbers::pi / 2, std::numbers::pi / 2, Severity::kFault);
  rest(std::numbers::pi, 0, Severity::kWarning);  // zero upright
}

TEST(MachineCheck, DryFrictionIsNoStuckEncoder) {
  MachineLog log = GoodLog();
  log.velocity.clear();
  // Joint 2 stops at once, rests for half a second and sets off gently.
  for (int k = 0; k < log.rows(); ++k) {
    const double t = std::fmod(log.time[k], 2.0);
    log.angle[k][1] = t < 1 ? 2 * t : t < 1.5 ? 2 : 2 - 8 * (t - 1.5) * (t - 1.5);
  }
  for (const Finding& f : Check(log)) EXPECT_EQ(f.severity, Severity::kNote) << f.text;
}

TEST(MachineCheck, WholeMillisecondsAndPushesByHand) {
  MachineLog log = GoodLog();
  log.velocity.clear();
  for (int k = 0; k < log.rows(); ++k) {
    log.time[k] = std::floor(2.5 * k) / 1000;
    log.push.push_back({std::sin(0.01 * k), 0});
    log.commanded[k] = {};
    log.measured[k] = {0.02 * std::sin(1.7 * k), 0};
  }
  const Findings found = Check(log);
  EXPECT_EQ(found[0].text.substr(0, 34), "400 Hz, cycles of 2.5 ms (usual), ");
  for (const Finding& f : found) EXPECT_EQ(f.severity, Severity::kNote) << f.text;
}

TEST(MachineCheck, TheMeasuredDataHaveNoFaults) {
  const auto real = RealData();
  if (real.empty()) GTEST_SKIP() << "no measured data in UPSWING_REAL or ../shared/real";
  int logs = 0;
  for (const char* folder :
       {"C.1/sysid", "C.1/swingup", "C.1/pushed", "A.0/free_decay", "cloudpendulum"}) {
    for (const auto& entry : std::filesystem::directory_iterator(real / folder)) {
      if (entry.path().extension() != ".gz") continue;
      auto pieces = ReadLog(entry.path());
      const LogCheck check = CheckLog(entry.path(), pieces);
      for (const Finding& f : check.findings) {
        EXPECT_NE(f.severity, Severity::kFault) << entry.path() << ": " << f.text;
        // In this log dry friction holds joint 2, the only such log.
        if (f.aspect != Aspect::kMotion || f.severity == Severity::kNote) continue;
        EXPECT_EQ(entry.path().stem(), "20230629-143906.csv") << f.text;
      }
      ++logs;
    }
  }
  EXPECT_EQ(logs, 49);
}

TEST(MachineCheck, MeasuredLogsOfCoarseEncodersHaveNoFaults) {
  const auto real = RealData();
  if (real.empty()) GTEST_SKIP() << "no measured data in UPSWING_REAL or ../shared/real";
  for (const char* file : {"C.1/sysid/20230629-143339.csv.gz", "C.1/sysid/20230629-143704.csv.gz",
                           "cloudpendulum/FreeFall_02.csv.gz"}) {
    const MachineLog exact = ReadLog(real / file).front();
    for (const double counts : {512, 1024, 2400}) {
      EXPECT_EQ(FaultsOf(Sampled(exact, 1, counts)), "") << file << ", " << counts << " counts";
    }
    MachineLog printed = exact;
    printed.velocity.clear();
    for (Joints& q : printed.angle)
      q = {std::round(1e4 * q[0]) / 1e4, std::round(1e4 * q[1]) / 1e4};
    EXPECT_EQ(FaultsOf(printed), "") << file << ", 4 digits";
  }
}

}  // namespace
}  // namespace upswing::machine
