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
  const auto runs = RunOlympics(twin, PolicyFor(twin, "lqr"), 1, 1, nullptr);
  ASSERT_EQ(runs.size(), 1u);
  EXPECT_FALSE(runs[0].held);
  // Only the pose upright is within its reach.
  EXPECT_LE(runs[0].poses, 3);
  EXPECT_FALSE(runs[0].perfect());
}

TEST(Olympics, ModelPredictiveControlSwingsUpAndSeedsRepeat) {
  const Twin twin = SmoothMachine();
  const MachinePolicy policy = PolicyFor(twin, "mpc");
  const auto first = RunOlympics(twin, policy, 1, 3, nullptr);
  EXPECT_TRUE(first[0].held);
  EXPECT_GE(first[0].poses, 1);
  const auto again = RunOlympics(twin, policy, 1, 3, nullptr);
  EXPECT_EQ(first[0].swing_up, again[0].swing_up);
  EXPECT_EQ(first[0].poses, again[0].poses);
}

TEST(Olympics, RefusesMachinesOfAnotherSize) {
  const Twin large = ReadTwin("realaigym-c1", "test");
  EXPECT_THROW(RunOlympics(large, PolicyFor(large, "lqr"), 1, 1, nullptr), Error);
}

}  // namespace
}  // namespace upswing::realaigym
