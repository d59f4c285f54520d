#include "extras/machine/logs/hypotheses.h"

#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <string>

#include "pendulum/equations.h"
#include "pendulum/runge_kutta.h"

namespace upswing::machine {
namespace {

constexpr double kRowPeriod = 0.002;  // s

/// Torques of both joints at a time (s).
using TorqueFunction = std::function<Joints(double t)>;

/// Torques that swing both links; `second`: share of joint 2's.
TorqueFunction TorquesOfBoth(double second) {
  return [=](double t) {
    return Joints{3 * std::sin(3 * t) + 2 * std::sin(7 * t),
                  second * (std::sin(4 * t + 1) + std::sin(9 * t))};
  };
}

/// A log of the equations of motion of the default plant, with measured torques.
MachineLog DrivenAtBothJoints(const PendulumState& start, double seconds,
                              const TorqueFunction& torques) {
  const Manipulator plant = ManipulatorOf(Plant{});
  MachineLog log;
  PendulumState x = start;
  for (int k = 0; k < seconds / kRowPeriod; ++k) {
    const double t = kRowPeriod * k;
    log.time.push_back(t);
    log.angle.push_back({x.q1, x.q2});
    log.measured.push_back(torques(t));
    const auto acceleration = [&](const PendulumState& s, double share) {
      return plant.Acceleration(s, torques(t + kRowPeriod * share));
    };
    x = RungeKuttaStep(x, acceleration(x, 0), kRowPeriod, acceleration);
  }
  return log;
}

/// Makes the measured torques commands.
void NameAsCommands(MachineLog& log) {
  log.commanded = std::move(log.measured);
  log.measured.clear();
}

Findings FindingsOn(const MachineLog& log) {
  return CheckLog("log.csv", std::span(&log, 1)).findings;
}

std::string FaultsIn(const MachineLog& log) {
  std::string faults;
  for (const Finding& f : FindingsOn(log)) {
    if (f.severity == Severity::kFault) faults += AboutText(f) + ": " + f.text + "\n";
  }
  return faults;
}

void SlipHalfWay(MachineLog& log, int joint, double turn) {
  for (int k = log.rows() / 2; k < log.rows(); ++k) log.angle[k][joint] += turn;
}

/// Adds an angle that grows to `turn` (rad) over the whole log.
void Drift(MachineLog& log, int joint, double turn) {
  for (int k = 0; k < log.rows(); ++k) log.angle[k][joint] += turn * k / log.rows();
}

TEST(Hypotheses, CommandsAsSharesOfTheLimitsAreNoNewtonMetres) {
  MachineLog log = DrivenAtBothJoints({}, 16, TorquesOfBoth(1));
  NameAsCommands(log);
  EXPECT_EQ(FaultsIn(log), "");
  for (Joints& u : log.commanded) u = {u[0] / 5, u[1] / 2};
  const std::string faults = FaultsIn(log);
  EXPECT_NE(faults.find("torque: 1 N·m of torque 1 moves the links like 2.5 N·m of torque 2"),
            std::string::npos)
      << faults;
  EXPECT_NE(faults.find("commands between -1 and 1"), std::string::npos);
  // The motion does not tell the unit of both torques.
  for (Joints& u : log.commanded) u[1] /= 2.5;
  EXPECT_EQ(FaultsIn(log), "");
}

TEST(Hypotheses, ASmallMeasuredTorqueActsToo) {
  MachineLog log = DrivenAtBothJoints({}, 16, TorquesOfBoth(0.2));  // 1% of the squares
  EXPECT_EQ(FaultsIn(log), "");
  SlipHalfWay(log, 0, 0.1);
  const std::string faults = FaultsIn(log);
  EXPECT_NE(faults.find("angle 1: suspect an encoder that slips by 0.1 rad"), std::string::npos)
      << faults;
}

TEST(Hypotheses, SmallSlipsAndDriftsAreNoFindings) {
  const MachineLog right = DrivenAtBothJoints({}, 8, TorquesOfBoth(1));
  const auto faults_with = [&](void (*damage)(MachineLog&, int, double), double turn) {
    MachineLog log = right;
    damage(log, 1, turn);
    return FaultsIn(log);
  };
  // Slips are small below 0.03 rad, drifts below 0.1 rad.
  EXPECT_EQ(faults_with(SlipHalfWay, 0.02), "");
  EXPECT_NE(faults_with(SlipHalfWay, 0.05).find("slips by 0.05 rad"), std::string::npos);
  EXPECT_EQ(faults_with(Drift, 0.08), "");
  EXPECT_NE(faults_with(Drift, 0.2).find("drifts"), std::string::npos) << faults_with(Drift, 0.2);
}

/// The ratio of the angles in the slow swing in which both links lean to the same side.
double RatioOfSlowSwing() {
  const Manipulator plant = ManipulatorOf(Plant{});
  double low = 0, high = 1;
  for (int i = 0; i < 40; ++i) {
    const double q1 = 0.1;
    const double ratio = (low + high) / 2;
    const auto a = plant.Acceleration({q1, ratio * q1, 0, 0}, {0, 0});
    if (a[1] / a[0] > ratio) {
      high = ratio;
    } else {
      low = ratio;
    }
  }
  return low;
}

TEST(Hypotheses, AnEncoderSlipsInAFreeSwingOfBothLinksInProportion) {
  const TorqueFunction none = [](double) { return Joints{}; };
  MachineLog log = DrivenAtBothJoints({0.9, 0.9 * RatioOfSlowSwing(), 0, 0}, 16, none);
  log.measured.clear();
  EXPECT_EQ(FaultsIn(log), "");
  SlipHalfWay(log, 1, 0.06);
  Pairs pairs;
  for (const Joints& q : log.angle) pairs.Add(q[0], q[1]);
  EXPECT_GT(pairs.correlation(), 0.95);  // in proportion for check
  const std::string faults = FaultsIn(log);
  EXPECT_NE(faults.find("angle 2: suspect an encoder that slips by 0.06 rad"), std::string::npos)
      << faults;
  EXPECT_EQ(faults.find("in proportion"), std::string::npos);
}

}  // namespace
}  // namespace upswing::machine
