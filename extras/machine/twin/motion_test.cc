#include "extras/machine/twin/motion.h"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

#include "extras/machine/logs/windows.h"
#include "extras/machine/twin/simulated_machine.h"

namespace upswing::machine {
namespace {

/// A machine whose values are all different from zero.
Twin MachineWithLag() {
  Twin twin;
  twin.plant.mass1 = 0.5;
  twin.plant.mass2 = 0.6;
  twin.plant.length1 = 0.2;
  twin.plant.length2 = 0.3;
  twin.plant.center1 = 0.18;
  twin.plant.center2 = 0.25;
  twin.plant.inertia1 = 0.01;
  twin.plant.inertia2 = 0.009;
  twin.plant.armature = 0.005;
  twin.plant.damping1 = 0.002;
  twin.plant.damping2 = 0.003;
  twin.plant.coulomb1 = 0.09;
  twin.plant.coulomb2 = 0.06;
  twin.actuator = {.delay = 0.003,
                   .lag = 0.004,
                   .passive_limit = 0.5,
                   .current_delay = 0.002,
                   .current_inertia = 0.0025};
  twin.sensors.zero1 = 0.02;
  twin.sensors.zero2 = -0.01;
  return twin;
}

/// The same machine with motors that cog.
Twin MachineThatCogs() {
  Twin twin = MachineWithLag();
  twin.cogging.slots = 12;
  twin.cogging.poles = 14;
  for (int j = 0; j < 2; ++j) {
    for (int k = 0; k < Cogging::kCoefficients; ++k) {
      twin.cogging.coefficients[j][k] = 0.03 * std::sin(1.0 + j + 2.0 * k);
    }
  }
  return twin;
}

/// A log with steps of the commanded torques, at an even rate.
MachineLog LogOfSteps() {
  MachineLog log;
  for (int k = 0; k < 100; ++k) {
    log.time.push_back(0.01 * k);
    log.angle.push_back({0, 0});
    log.commanded.push_back({k < 50 ? 1.0 : -2.0, k % 20 < 10 ? 0.3 : 0});
  }
  return log;
}

/// A log of 2 s without torques, for motions that go on by themselves.
MachineLog LogWithoutTorques() {
  MachineLog log;
  for (int k = 0; k < 1000; ++k) {
    log.time.push_back(0.002 * k);
    log.angle.push_back({});
  }
  return log;
}

TEST(Drive, FollowsACommandWithDelayAndLag) {
  const Twin twin = MachineWithLag();
  const Drive drive = Drive::Commanded(LogOfSteps(), twin);
  int cursor = 0;
  // The command of row 0 is sent with the angles of row 1, at 0.01 s, and acts from 0.013 s on.
  EXPECT_EQ(drive.At(0.0129, cursor)[0], 0);
  EXPECT_NEAR(drive.At(0.013 + 0.004, cursor)[0], 1 - std::exp(-1), 1e-12);
  EXPECT_NEAR(drive.At(0.4, cursor)[0], 1, 1e-12);
  // Joint 1 goes from 1 to -2 at 0.513 s. A search may also go back.
  EXPECT_NEAR(drive.At(0.513 + 0.004, cursor)[0], -2 + 3 * std::exp(-1), 1e-12);
  EXPECT_NEAR(drive.At(0.013 + 0.004, cursor)[0], 1 - std::exp(-1), 1e-12);
}

TEST(Drive, LimitsTheJointThatOnlyCompensatesFriction) {
  MachineLog log = LogOfSteps();
  for (Joints& u : log.commanded) u = {0.7, 4};
  log.push.assign(log.commanded.size(), {0.1, 0});
  const Twin twin = MachineWithLag();
  EXPECT_EQ(ActuatedJoint(log, twin), 2);
  int cursor = 0;
  const Joints torque = Drive::Commanded(log, twin).At(0.9, cursor);
  EXPECT_NEAR(torque[0], 0.5 + 0.1, 1e-9);  // pushes come after the limit
  EXPECT_NEAR(torque[1], 4, 1e-9);
}

TEST(Drive, ForgetsOnlyCommandsThatNoLongerMatter) {
  Drive all(0.003, 0.004), forgetful(0.003, 0.004);
  for (int k = 0; k < 200; ++k) {
    const double time = 0.002 * k;
    const Joints command{std::sin(0.3 * k), std::cos(0.2 * k)};
    all.Add(time, command);
    forgetful.Add(time, command);
    forgetful.Forget(time);
    int a = 0, b = 0;
    EXPECT_EQ(all.At(time + 0.001, a), forgetful.At(time + 0.001, b));
  }
}

TEST(Predict, ConservesEnergyWithoutFrictionAndTorque) {
  Twin twin = MachineWithLag();
  twin.plant.damping1 = twin.plant.damping2 = twin.plant.coulomb1 = twin.plant.coulomb2 = 0;
  const MachineLog log = LogWithoutTorques();
  const Body body = BodyOf(twin);
  const Motion motion = Predict({body, Drive::Commanded(log, twin)}, {1, 0.5, 0, 0}, log.time);
  const auto energy = [&](int k) {
    return body
        .At({motion.angle[k][0], motion.angle[k][1], motion.velocity[k][0], motion.velocity[k][1]})
        .energy;
  };
  EXPECT_NEAR(energy(999), energy(0), 1e-6);
}

/// Compares a simulated machine's log with the prediction of its twin. The two integrate the same
/// equations with other steps, from a log and online. Torques that jump within a step leave errors
/// of 1e-5 rad, which grow tenfold in 2 s.
void ExpectPredictionRepeatsTheLog(double delay, double current_delay) {
  Twin twin = MachineWithLag();
  twin.actuator.delay = delay;
  twin.actuator.current_delay = current_delay;
  twin.loop = {.period = 0.005, .jitter = 0.0002, .late_share = 0.1, .late = 0.003};
  const MachineLog log = RunLoop(twin, {.seconds = 2, .start = {0.5, -0.3, 0, 0}, .seed = 3},
                                 [](const CycleInput& in) -> Joints {
                                   return {1.5 * std::sin(6 * in.time), std::cos(4 * in.time)};
                                 });
  const Motion motion = Predict(CommandedModel(log, twin), {0.52, -0.31, 0, 0}, log.time,
                                twin.actuator.current_delay);
  const Drive drive = Drive::Commanded(log, twin);
  for (int k = 10; k < log.rows() - 2; k += 20) {
    int cursor = 0;
    const Joints torque = drive.At(log.time[k] - current_delay, cursor);
    for (int j = 0; j < 2; ++j) {
      EXPECT_NEAR(motion.angle[k][j], log.angle[k][j], 3e-4) << k << " " << delay;
      const double reported = torque[j] - twin.actuator.current_inertia * motion.acceleration[k][j];
      EXPECT_NEAR(reported, log.measured[k][j], 0.01) << k << " " << delay << " " << current_delay;
    }
  }
}

TEST(Predict, RepeatsTheMotionOfTheSimulatedMachine) {
  for (const double delay : {-0.004, -0.002, 0.0, 0.002, 0.004}) {
    ExpectPredictionRepeatsTheLog(delay, 0.002);
  }
  for (const double current_delay : {-0.002, 0.0, 0.004}) {
    ExpectPredictionRepeatsTheLog(0.003, current_delay);
  }
}

/// Differences of predictions are the reference.
void ExpectDerivatives(const Twin& twin, Detail detail) {
  const MachineLog log = RunLoop(twin, {.seconds = 0.5, .start = {0.5, -0.3, 0, 0}},
                                 [](const CycleInput& in) -> Joints {
                                   return {1.5 * std::sin(6 * in.time), std::cos(4 * in.time)};
                                 });
  std::array<double, kMostTangents> values{0.5, -0.3, 1, 2};
  Body body = BodyOf(twin);
  body.detail = detail;
  for (int k = 0; k < kNumManipulatorConstants; ++k) {
    values[tangent::kBody + k] = body.*kManipulatorConstants[k];
  }
  // No event is at an end of a step, where the derivative jumps.
  values[tangent::kDelay] = 0.0023;
  values[tangent::kLag] = twin.actuator.lag;
  values[tangent::kOffset] = twin.actuator.torque_offset1;
  values[tangent::kOffset + 1] = twin.actuator.torque_offset2;
  for (int i = 0; i < 2 * Cogging::kCoefficients; ++i) {
    values[tangent::kCogging + i] =
        twin.cogging.coefficients[i / Cogging::kCoefficients][i % Cogging::kCoefficients];
  }
  values[tangent::kZero] = twin.sensors.zero1;
  values[tangent::kZero + 1] = twin.sensors.zero2;
  const auto predict = [&](const std::array<double, kMostTangents>& v, MotionTangents* tangents) {
    Twin other = twin;
    other.sensors.zero1 = v[tangent::kZero];
    other.sensors.zero2 = v[tangent::kZero + 1];
    other.actuator.delay = v[tangent::kDelay];
    other.actuator.lag = v[tangent::kLag];
    other.actuator.torque_offset1 = v[tangent::kOffset];
    other.actuator.torque_offset2 = v[tangent::kOffset + 1];
    for (int i = 0; i < 2 * Cogging::kCoefficients; ++i) {
      other.cogging.coefficients[i / Cogging::kCoefficients][i % Cogging::kCoefficients] =
          v[tangent::kCogging + i];
    }
    MotionModel model{BodyOf(other), Drive::Commanded(log, other)};
    model.body.detail = detail;
    for (int k = 0; k < kNumManipulatorConstants; ++k) {
      model.body.*kManipulatorConstants[k] = v[tangent::kBody + k];
    }
    return Predict(model, {v[0], v[1], v[2], v[3]}, std::span(log.time).subspan(2), 0.003,
                   tangents);
  };
  MotionTangents tangents;
  predict(values, &tangents);
  for (int i = 0; i < body.tangents(); ++i) {
    const double h = 1e-6 * std::max(0.01, std::abs(values[i]));
    auto above = values, below = values;
    above[i] += h;
    below[i] -= h;
    const Motion a = predict(above, nullptr), b = predict(below, nullptr);
    for (int k = 0; k < log.rows() - 2; k += 20) {
      for (int j = 0; j < 2; ++j) {
        const double angle = (a.angle[k][j] - b.angle[k][j]) / (2 * h);
        const double acceleration = (a.acceleration[k][j] - b.acceleration[k][j]) / (2 * h);
        EXPECT_NEAR(tangents.angle(i, 2 * k + j), angle, 1e-4 * (1 + std::abs(angle))) << i;
        EXPECT_NEAR(tangents.acceleration(i, 2 * k + j), acceleration,
                    1e-3 * (1 + std::abs(acceleration)))
            << i;
      }
    }
  }
}

TEST(Predict, KnowsItsDerivatives) { ExpectDerivatives(MachineWithLag(), Detail::kUsual); }
TEST(Predict, KnowsTheDerivativesByOffsets) {
  Twin twin = MachineWithLag();
  twin.actuator.torque_offset1 = 0.2;
  twin.actuator.torque_offset2 = -0.1;
  ExpectDerivatives(twin, Detail::kOffsets);
}
TEST(Predict, KnowsTheDerivativesByCogging) {
  ExpectDerivatives(MachineThatCogs(), Detail::kCogging);
}

/// Cogging is the slope of a potential, so it keeps the energy with it.
TEST(Predict, ConservesEnergyWithCogging) {
  Twin twin = MachineThatCogs();
  twin.plant.damping1 = twin.plant.damping2 = twin.plant.coulomb1 = twin.plant.coulomb2 = 0;
  const MachineLog log = LogWithoutTorques();
  const Body body = BodyOf(twin);
  const auto harmonics = twin.cogging.Harmonics();
  const Joints zero{twin.sensors.zero1, twin.sensors.zero2};
  const Motion motion = Predict({body, Drive::Commanded(log, twin)}, {1, 0.5, 0, 0}, log.time);
  const auto energy = [&](int k) {
    const Joints &q = motion.angle[k], &w = motion.velocity[k];
    double sum = body.At({q[0], q[1], w[0], w[1]}).energy;
    for (int j = 0; j < 2; ++j) {
      const auto& c = twin.cogging.coefficients[j];
      for (int i = 0; i < Cogging::kHarmonics; ++i) {
        const double n = harmonics[i];
        const double angle = n * (q[j] + zero[j]);
        sum += (c[i] * std::cos(angle) - c[i + Cogging::kHarmonics] * std::sin(angle)) / n;
      }
    }
    return sum;
  };
  for (const int k : {100, 500, 999}) EXPECT_NEAR(energy(k), energy(0), 1e-5) << k;
}

/// A step of kMotionStep would be unstable.
TEST(Predict, FollowsStrongFrictionOfLightLinks) {
  Twin twin = MachineWithLag();
  twin.plant.inertia1 = twin.plant.inertia2 = 1e-6;
  twin.plant.center1 = twin.plant.center2 = 0.002;
  twin.plant.length1 = 0.004;
  twin.plant.armature = 2e-5;
  MotionModel coarse = CommandedModel(LogOfSteps(), twin), fine = coarse;
  EXPECT_LT(coarse.body.longest_step, kMotionStep / 4);
  fine.body.longest_step = coarse.body.longest_step / 16;
  const std::vector<double> times{0.1, 0.15, 0.2, 0.3};
  const PendulumState start{0.5, -0.3, 20, -10};
  const Motion a = Predict(coarse, start, times), b = Predict(fine, start, times);
  for (size_t k = 0; k < times.size(); ++k) {
    for (int j = 0; j < 2; ++j) EXPECT_NEAR(a.angle[k][j], b.angle[k][j], 1e-3) << k;
  }
}

/// A loop that stalls again and again leaves no window without a gap.
TEST(CutWindows, TakeTheGapsOfALoopThatStalls) {
  const auto windows = [](double stall) {
    MachineLog log;
    double t = 0;
    for (int k = 0; k < 500; ++k, t += k % 20 == 0 ? stall : 0.001) {
      log.time.push_back(t);
      log.angle.push_back({0.4 * std::sin(5 * t), 0.3 * std::cos(7 * t)});
    }
    return CutWindows(std::span(&log, 1), {.seconds = 0.3, .hop = 0.15}, 0.2, 0.3).size();
  };
  EXPECT_GT(windows(0.07), 5u);
  EXPECT_EQ(windows(0.12), 0u);
}

TEST(CutWindows, StartInTheTrueState) {
  Twin twin = MachineWithLag();
  MachineLog log;
  for (int k = 0; k < 500; ++k) {
    const double t = 0.002 * k;
    log.time.push_back(t);
    log.angle.push_back({0.4 * std::sin(5 * t), 0.3 * std::cos(7 * t)});
  }
  const auto windows = CutWindows(std::span(&log, 1), {.seconds = 0.2, .hop = 0.1}, 0.2, 0.3);
  ASSERT_EQ(windows.size(), 7u);  // from 0.05 s on, up to 0.05 s before the end
  for (const LogWindow& w : windows) {
    const double t = log.time[w.first];
    EXPECT_NEAR(w.start.q1, 0.4 * std::sin(5 * t), 1e-5);
    EXPECT_NEAR(w.start.w1, 2.0 * std::cos(5 * t), 1e-3);
    EXPECT_NEAR(w.start.w2, -2.1 * std::sin(7 * t), 3e-3);
    EXPECT_NEAR(log.time[w.last - 1] - t, 0.2, 0.0021);
  }
}

TEST(CutWindows, SkipUprightMotionGapsAndRest) {
  MachineLog log;
  for (int k = 0; k < 1000; ++k) {
    const double t = 0.002 * k;
    log.time.push_back(t + (k >= 250 ? 0.05 : 0));  // a gap
    const bool upright = k >= 500 && k < 750, rests = k >= 750;
    log.angle.push_back({upright ? std::numbers::pi : rests ? 0.1 : 0.5 * std::sin(9 * t), 0});
  }
  for (const LogWindow& w :
       CutWindows(std::span(&log, 1), {.seconds = 0.1, .hop = 0.05}, 0.2, 0.3)) {
    EXPECT_LE(w.last, 500);
    EXPECT_FALSE(w.first < 250 && w.last > 250);
  }
}

TEST(CutWindows, JumpOverALongGap) {
  MachineLog log;
  for (int k = 0; k < 1000; ++k) {
    const double t = 0.002 * k;
    log.time.push_back(t + (k >= 500 ? 1e9 : 0));
    log.angle.push_back({0.5 * std::sin(9 * t), 0});
  }
  const auto windows = CutWindows(std::span(&log, 1), {.seconds = 0.1, .hop = 0.05}, 0.2, 0.3);
  // No window twice: a start within the gap does not count.
  for (size_t i = 1; i < windows.size(); ++i) EXPECT_GT(windows[i].first, windows[i - 1].first);
  ASSERT_FALSE(windows.empty());
  EXPECT_LT(windows.front().last, 500);
  EXPECT_GE(windows.back().first, 500);
}

}  // namespace
}  // namespace upswing::machine
