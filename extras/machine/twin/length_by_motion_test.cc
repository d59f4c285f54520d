#include "extras/machine/twin/length_by_motion.h"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

#include "extras/machine/twin/identify.h"
#include "extras/machine/twin/simulated_machine.h"
#include "extras/machine/twin/testing.h"

namespace upswing::machine {
namespace {

Twin ImageOfTestTwin(double length) {
  Twin twin = ImageOf(TestTwin(), ImageOfLength(length));
  twin.sensors.quantum = 2 * std::numbers::pi / 4096;
  twin.sensors.angle_range = 1000;
  twin.loop.period = 0.002;
  return twin;
}

/// A swing of 12 s by the natural time: free, or under torques of both joints.
MachineLog LongSwing(const Twin& machine, const Image& image, bool is_free) {
  const CycleController torques = [&](const CycleInput& in) {
    const double t = in.time / image.time, u = is_free ? 0 : image.torque();
    return Joints{u * (0.5 * std::sin(4 * t) + 0.4 * std::sin(9 * t + 1)),
                  u * (0.3 * std::sin(6 * t + 2) + 0.2 * std::sin(11 * t))};
  };
  return RunLoop(machine, {.seconds = 12 * image.time, .start = {2, -0.5, 0, 0}}, torques);
}

/// The line about logs of a machine of this size after a change of the log and of the twin.
std::string LineOf(double length, bool is_free, double clock, double twin_length) {
  Twin twin = ImageOfTestTwin(length);
  MachineLog log = LongSwing(twin, ImageOfLength(length), is_free);
  for (double& t : log.time) t *= clock;
  // No log tells masses apart from torques and centres.
  twin.plant.mass1 *= 1.5;
  twin.plant.center2 = 0.4 * twin.plant.length2;
  twin.plant.length1 *= twin_length;
  return LengthContradiction({&log, 1}, twin, twin.plant.length1);
}

TEST(LengthByMotion, AgreesWithTheMachine) {
  for (const double length : {0.1, 1.0, 4.0}) {
    for (const bool is_free : {false, true}) {
      const Twin machine = ImageOfTestTwin(length);
      const MachineLog log = LongSwing(machine, ImageOfLength(length), is_free);
      const auto found = FindLengthByMotion({&log, 1}, machine);
      ASSERT_TRUE(found) << length;
      EXPECT_NEAR(found->length / machine.plant.length1, 1, 0.02) << length << is_free;
      EXPECT_LT(found->deviation, 0.04) << length << is_free;
      EXPECT_EQ(LineOf(length, is_free, 1, 1), "");
    }
  }
}

TEST(LengthByMotion, AClockOrALengthThatIsWrongIsFound) {
  for (const double length : {0.1, 1.0, 4.0}) {
    for (const bool is_free : {false, true}) {
      EXPECT_NE(LineOf(length, is_free, 1.05, 1), "") << length;
      EXPECT_NE(LineOf(length, is_free, 0.95, 1), "") << length;
      EXPECT_NE(LineOf(length, is_free, 1, 0.8), "") << length;
    }
  }
  EXPECT_EQ(
      LineOf(1, true, 1.1, 1),
      "the motion shows length1 = 0.242 m ± 3%, not 0.2 m: is the length wrong, does the clock "
      "run 9.9% fast, or is gravity 8.12 m/s²?");
}

TEST(LengthByMotion, AFitOfTheLengthDoesNotHideAWrongClock) {
  Twin twin = ImageOfTestTwin(1);
  const double given = twin.plant.length1;
  MachineLog log = LongSwing(twin, ImageOfLength(1), /*is_free=*/true);
  for (double& t : log.time) t *= 1.1;
  twin.plant.length1 *= 1.21;  // what a fit finds
  Judgement judgement;
  judgement.explanation = Explanation::kToNoise;
  EXPECT_EQ(DistrustOf(judgement, twin, {&log, 1}, twin.plant.length1), "");
  EXPECT_NE(DistrustOf(judgement, twin, {&log, 1}, given).find("the motion shows length1"),
            std::string::npos);
}

TEST(LengthByMotion, LinksThatHardlyMoveTellNothing) {
  Twin machine = ImageOfTestTwin(1);
  MachineLog log = LongSwing(machine, ImageOfLength(1), true);
  for (Joints& q : log.angle) q = {0.001 * std::sin(q[0]), 0};
  machine.plant.length1 *= 2;
  EXPECT_EQ(LengthContradiction({&log, 1}, machine, machine.plant.length1), "");
}

}  // namespace
}  // namespace upswing::machine
