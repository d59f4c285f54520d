#include "extras/machine/twin/judgement.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <numbers>

#include "base/error.h"
#include "extras/machine/twin/identify.h"
#include "extras/machine/twin/simulated_machine.h"
#include "extras/machine/twin/testing.h"
#include "runs/plant_file.h"

namespace upswing::machine {
namespace {

/// An encoder, a logger and a machine.
struct LabSetup {
  double counts, hz, digits, length;  // of a turn, 1/s, printed decimals, of UsualPlant's
};

/// A swing under torques of both joints, by the natural time of the machine.
MachineLog SwingOf(const Twin& machine, const Image& image, double digits, double seconds = 4) {
  const CycleController torques = [&](const CycleInput& in) {
    const double t = in.time / image.time;
    return Joints{image.torque() * (0.5 * std::sin(4 * t) + 0.4 * std::sin(9 * t + 1)),
                  image.torque() * (0.3 * std::sin(6 * t + 2) + 0.2 * std::sin(11 * t))};
  };
  MachineLog log =
      RunLoop(machine, {.seconds = seconds * image.time, .start = {0.9, -0.5, 0, 0}}, torques);
  const double step = std::pow(10, -digits);
  for (Joints& q : log.angle) {
    for (double& angle : q) angle = step * std::round(angle / step);
  }
  return log;
}

Twin MachineOf(const LabSetup& setup) {
  Twin twin = ImageOf(TestTwin(), ImageOfLength(setup.length));
  twin.sensors = MachineSensors();
  twin.sensors.quantum = 2 * std::numbers::pi / setup.counts;
  twin.actuator.delay = 0.001;
  twin.actuator.lag = 0.002;
  twin.loop.period = 1 / setup.hz;
  return twin;
}

/// The rounding of a uniform error has the standard deviation step / √12.
double NoiseOf(const LabSetup& setup) {
  const double quantum = 2 * std::numbers::pi / setup.counts, printed = std::pow(10, -setup.digits);
  return std::hypot(quantum, printed) / std::sqrt(12);
}

const LabSetup kLabs[] = {{512, 2000, 6, 1},    {512, 50, 9, 1},       {1024, 500, 4, 0.1},
                          {2400, 100, 9, 4},    {4096, 1000, 3, 1},    {16384, 500, 4, 4},
                          {16384, 200, 9, 0.1}, {1 << 20, 2000, 9, 1}, {1 << 20, 500, 6, 0.1},
                          {1 << 20, 100, 4, 1}};

/// A machine is explained by itself, whatever its size and encoders, and to their noise.
TEST(Judgement, AMachineExplainsItsLogsToTheNoise) {
  for (const LabSetup& setup : kLabs) {
    const Twin machine = MachineOf(setup);
    const MachineLog log = SwingOf(machine, ImageOfLength(setup.length), setup.digits);
    const Judgement judgement = Judge({&log, 1}, {&machine, 1}, "its log", nullptr);
    const std::string about = testing::PrintToString(setup.counts) + " counts, " +
                              testing::PrintToString(setup.hz) + " Hz: " + SentenceOf(judgement);
    EXPECT_EQ(judgement.explanation, Explanation::kToNoise) << about;
    for (const double noise : judgement.noise) {
      EXPECT_GT(noise, 0.75 * NoiseOf(setup)) << about;
      EXPECT_LT(noise, 1.5 * NoiseOf(setup)) << about;
    }
  }
}

TEST(Judgement, MultiplesOfTheNoiseAreWrittenWithoutAnExponent) {
  Judgement judgement;
  judgement.explanation = Explanation::kToMultiple;
  judgement.logs = "the logs";
  judgement.seconds = 1;
  judgement.error = 0.033;
  judgement.times_noise = 104;
  judgement.share = 0.035;
  EXPECT_EQ(SentenceOf(judgement),
            "the model explains the logs to 104 times the encoders' noise: 0.033 rad over 1 s, "
            "3.5% of the motion");
}

/// A fit to a changed log that begins 20% away from the machine.
Identification Fitted(const LabSetup& setup, const std::function<void(MachineLog&)>& change) {
  const Twin machine = MachineOf(setup);
  MachineLog log = SwingOf(machine, ImageOfLength(setup.length), setup.digits, 12);
  log.name = "log-1.csv";
  log.measured.clear();
  change(log);
  Twin guess = machine;
  guess.plant.inertia1 *= 1.2;
  guess.plant.center2 *= 0.8;
  const double window = ScaleOverUsual(guess.plant).time;
  ThreadPool pool(2);
  return Identify({&log, 1}, guess,
                  {.fit = {.windows = {window, window}, .tolerance = 1e-4}, .folds = 0}, &pool);
}

TEST(Judgement, AFitToRightLogsIsTrusted) {
  for (const LabSetup& setup : {LabSetup{4096, 500, 6, 1}, LabSetup{1 << 20, 1000, 9, 0.1}}) {
    const Identification found = Fitted(setup, [](MachineLog&) {});
    EXPECT_EQ(found.judgement.explanation, Explanation::kToNoise) << SentenceOf(found.judgement);
    EXPECT_EQ(found.fit.twin.distrust, "");
  }
}

TEST(Judgement, AFitToWrongLogsIsNotTrusted) {
  const auto doubled = [](MachineLog& log) {
    for (Joints& q : log.angle) q[1] *= 2;
  };
  const auto flipped = [](MachineLog& log) {
    for (int k = log.rows() / 2; k < log.rows(); ++k) log.angle[k][1] *= -1;
  };
  const auto absolute = [](MachineLog& log) {
    for (Joints& q : log.angle) q[1] += q[0];
  };
  for (const std::function<void(MachineLog&)>& wrong :
       {std::function<void(MachineLog&)>(doubled), std::function<void(MachineLog&)>(flipped),
        std::function<void(MachineLog&)>(absolute)}) {
    const Identification found = Fitted({4096, 500, 6, 1}, wrong);
    EXPECT_EQ(found.judgement.explanation, Explanation::kNone) << SentenceOf(found.judgement);
    EXPECT_NE(found.fit.twin.distrust, "");
  }
}

/// A file keeps the reason, and a file without it is a twin that is trusted.
TEST(Judgement, AFileKeepsTheReason) {
  Twin twin = TestTwin();
  EXPECT_EQ(ParseTwin(TwinText(twin), "file").distrust, "");
  twin.distrust = "the model does not explain \"the logs\"";
  const Twin read = ParseTwin(TwinText(twin), "file");
  EXPECT_EQ(read.distrust, twin.distrust);
  EXPECT_EQ(ParsePlantFile(TwinText(twin), "file").distrust, twin.distrust);
  EXPECT_EQ(TwinText(read), TwinText(twin));
  EXPECT_THROW(ParseTwin("distrust = 3\n[plant]\n", "file"), Error);
}

}  // namespace
}  // namespace upswing::machine
