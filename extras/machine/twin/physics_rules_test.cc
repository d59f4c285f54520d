#include "extras/machine/twin/physics_rules.h"

#include <gtest/gtest.h>

#include <cmath>
#include <functional>

#include "extras/machine/twin/testing.h"

namespace upswing::machine {
namespace {

Twin Fitted() {
  Twin twin;
  twin.plant = UsualPlant();
  twin.plant.damping1 = twin.plant.damping2 = 0.002;
  twin.plant.coulomb1 = twin.plant.coulomb2 = 0.05;
  twin.loop.period = 0.002;
  twin.uncertain = {"center1",  "center2",  "inertia1", "inertia2", "armature", "damping1",
                    "damping2", "coulomb1", "coulomb2", "delay",    "lag",      "zero1"};
  twin.covariance.assign(twin.uncertain.size() * twin.uncertain.size(), 0);
  return twin;
}

/// The lines about a twin that `change` makes impossible, in three sizes: they must be of one kind.
std::string LineAfter(const std::function<void(Twin&)>& change, bool reports = true) {
  std::string line;
  for (const double length : {0.1, 1.0, 4.0}) {
    Twin twin = Fitted();
    change(twin);
    const Image image{length, std::pow(length, 3), std::sqrt(length)};
    Twin other = ImageOf(twin, image);
    other.actuator = twin.actuator;  // motors and loops of any size have the same times
    other.loop = twin.loop;
    const auto lines = OutsidePhysics(other, reports);
    EXPECT_LE(lines.size(), 1u) << length;
    const std::string now = lines.empty() ? "" : lines.front().substr(0, lines.front().find(" is"));
    if (length != 0.1) {
      EXPECT_EQ(now, line) << length;
    }
    line = now;
  }
  return line;
}

TEST(OutsidePhysics, AMachineIsWithin) {
  EXPECT_EQ(LineAfter([](Twin&) {}), "");
  // Many machines have none of these.
  EXPECT_EQ(LineAfter([](Twin& t) {
              t.plant.armature = t.plant.damping1 = t.plant.coulomb2 = t.actuator.lag = 0;
            }),
            "");
}

TEST(OutsidePhysics, CentresAreWithinLinks) {
  EXPECT_EQ(LineAfter([](Twin& t) { t.plant.center1 = 0.299; }), "center1");
  EXPECT_EQ(LineAfter([](Twin& t) { t.plant.center2 = 0.31; }), "center2");
  EXPECT_EQ(LineAfter([](Twin& t) { t.plant.center2 = t.plant.length2; }), "");
}

TEST(OutsidePhysics, InertiasAreThoseOfLinks) {
  EXPECT_EQ(LineAfter([](Twin& t) { t.plant.inertia1 = 1e-9; }), "inertia1");
  EXPECT_EQ(LineAfter([](Twin& t) { t.plant.inertia2 = 0.24; }), "inertia2");
}

TEST(OutsidePhysics, ValuesAreWithinTheirRanges) {
  EXPECT_EQ(LineAfter([](Twin& t) { t.actuator.lag = 0.1; }), "lag");
  EXPECT_EQ(LineAfter([](Twin& t) { t.sensors.zero1 = -1; }), "zero1");
  EXPECT_EQ(LineAfter([](Twin& t) { t.plant.center1 = 1e-6; }), "center1");
}

TEST(OutsidePhysics, TorquesActAfterCommands) {
  const auto delay = [](double cycles) {
    return [=](Twin& t) { t.actuator.delay = cycles * t.loop.period; };
  };
  EXPECT_EQ(LineAfter(delay(-1)), "");
  EXPECT_EQ(LineAfter(delay(-1.2)), "delay");
  // A lag makes up for a delay: slow torques do not tell which.
  EXPECT_EQ(LineAfter([](Twin& t) {
              t.actuator.delay = -1.5 * t.loop.period;
              t.actuator.lag = 0.5 * t.loop.period;
            }),
            "");
  // Measured torques may be some milliseconds or a cycle old.
  const auto of_slow_loop = [](double cycles) {
    return [=](Twin& t) {
      t.loop.period = 0.02;
      t.actuator.delay = cycles * t.loop.period;
    };
  };
  EXPECT_EQ(LineAfter(of_slow_loop(-2), /*reports=*/false), "");
  EXPECT_EQ(LineAfter(of_slow_loop(-3), /*reports=*/false), "delay");
  EXPECT_EQ(LineAfter(delay(-1.2), /*reports=*/false), "");
  EXPECT_EQ(LineAfter(delay(-6.5), /*reports=*/false), "delay");
}

TEST(OutsidePhysics, FrictionLetsJointsMove) {
  EXPECT_EQ(LineAfter([](Twin& t) { t.plant.coulomb2 = 6; }), "coulomb2");
  EXPECT_EQ(LineAfter([](Twin& t) { t.plant.coulomb2 = 1; }), "");
}

TEST(OutsidePhysics, ASessionHasItsOwnLine) {
  Twin twin = Fitted();
  twin.sessions = {{"monday", {{"center1", 0.1}}}, {"tuesday", {{"center1", 0.25}}}};
  const auto lines = OutsidePhysics(twin, true);
  ASSERT_EQ(lines.size(), 1u);
  EXPECT_TRUE(lines.front().starts_with("session tuesday: center1 is 0.25 m")) << lines.front();
}

TEST(OutsidePhysics, ShippedTwinsAreWithin) {
  for (const char* name : {"cloudpendulum", "realaigym-twin"}) {
    const auto lines = OutsidePhysics(ReadTwin(name, ""), name != std::string("cloudpendulum"));
    EXPECT_TRUE(lines.empty()) << name << ": " << lines.front();
  }
}

}  // namespace
}  // namespace upswing::machine
