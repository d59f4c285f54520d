#include "extras/realaigym/olympics.h"

#include <gtest/gtest.h>

#include <string>

#include "base/error.h"

namespace upswing::realaigym {
namespace {

/// A machine of CloudPendulum whose joints have no dry friction, so that a linear controller holds
/// it, and whose encoders have no errors.
Twin SmoothMachine() {
  Twin twin = ReadTwin("cloudpendulum", "test");
  twin.plant.coulomb1 = twin.plant.coulomb2 = 0;
  twin.sensors.zero1 = twin.sensors.zero2 = 0;
  twin.uncertain.clear();
  twin.covariance.clear();
  twin.sessions.clear();
  return twin;
}

MachinePolicy PolicyFor(const Twin& twin, const std::string& name) {
  PolicyArguments arguments;
  arguments.name = name;
  return GetMachinePolicy(arguments, "", twin, kOlympicsHz);
}

TEST(Olympics, AControllerThatOnlyBalancesNeverSwingsUp) {
  const Twin twin = SmoothMachine();
  const auto runs = RunOlympics(twin, PolicyFor(twin, "lqr"), twin, 1, 1, nullptr);
  ASSERT_EQ(runs.size(), 1u);
  EXPECT_FALSE(runs[0].held);
  // Only the pose upright is within its reach.
  EXPECT_LE(runs[0].poses, 3);
  EXPECT_FALSE(runs[0].perfect());
}

TEST(Olympics, ModelPredictiveControlSwingsUpAndSeedsRepeat) {
  const Twin twin = SmoothMachine();
  const MachinePolicy policy = PolicyFor(twin, "mpc");
  const auto first = RunOlympics(twin, policy, twin, 1, 3, nullptr);
  EXPECT_TRUE(first[0].held);
  EXPECT_GE(first[0].poses, 1);
  const auto again = RunOlympics(twin, policy, twin, 1, 3, nullptr);
  EXPECT_EQ(first[0].swing_up, again[0].swing_up);
  EXPECT_EQ(first[0].poses, again[0].poses);
}

TEST(Olympics, RunsAreOnTheMachineAndThePilotKnowsTheTwin) {
  const Twin twin = SmoothMachine();
  const MachinePolicy policy = PolicyFor(twin, "lqr");
  // The controller only balances, so its swing-up ends beyond the limits, at a time that depends on
  // the machine's motion and on the torques that the twin permits.
  const auto end = [&](const Twin& known, const Twin& machine) {
    const OlympicsRun run = RunOlympics(known, policy, machine, 1, 1, nullptr)[0];
    EXPECT_FALSE(run.within_limits);
    return run.swing_up;
  };
  Twin light = twin;
  light.plant.mass2 *= 0.5;
  Twin weak = twin;
  weak.plant.torque_limit *= 0.5;
  EXPECT_EQ(end(twin, twin), end(twin, twin));
  EXPECT_NE(end(twin, light), end(twin, twin));
  EXPECT_NE(end(weak, twin), end(twin, twin));
}

TEST(Olympics, RefusesMachinesOfAnotherSize) {
  const Twin large = ReadTwin("realaigym-c1", "test"), small = SmoothMachine();
  EXPECT_THROW(RunOlympics(large, PolicyFor(large, "lqr"), large, 1, 1, nullptr), Error);
  EXPECT_THROW(RunOlympics(small, PolicyFor(small, "lqr"), large, 1, 1, nullptr), Error);
}

}  // namespace
}  // namespace upswing::realaigym
