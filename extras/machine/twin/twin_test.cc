#include "extras/machine/twin/twin.h"

#include <gtest/gtest.h>

#include <cmath>

#include "base/error.h"
#include "base/text.h"
#include "runs/plant_file.h"

namespace upswing::machine {
namespace {

Twin SomeTwin() {
  Twin twin;
  twin.name = "a \"twin\"";
  twin.plant.mass1 = 0.5;
  twin.plant.center2 = 0.25;
  twin.plant.coulomb1 = 0.1;
  twin.actuator = {.delay = -0.001,
                   .lag = 0.004,
                   .passive_limit = 0.5,
                   .current_delay = 0.002,
                   .current_inertia = 0.0025};
  twin.sensors.zero1 = 0.01;
  twin.sensors.velocity_share = 0.2;
  twin.loop.late_share = 0.01;
  twin.uncertain = {"center2", "zero1", "lag"};
  twin.covariance = {4e-6, 1e-6, 0, 1e-6, 9e-4, 0, 0, 0, 1e-8};
  twin.sessions = {{"day/run-", {{"coulomb1", 0.12}, {"zero1", 0.02}, {"zero2", -0.03}}},
                   {"other", {}}};
  return twin;
}

/// The message for a text that is no twin.
std::string MessageFor(const std::string& text) {
  try {
    ParseTwin(text, "t.toml");
  } catch (const Error& error) {
    return error.what();
  }
  return "";
}

TEST(Twin, SurvivesTheRoundTrip) {
  const Twin twin = SomeTwin();
  const std::string text = TwinText(twin);
  const Twin again = ParseTwin(text, "t.toml");
  EXPECT_EQ(TwinText(again), text);
  EXPECT_EQ(again.name, twin.name);
  EXPECT_EQ(again.uncertain, twin.uncertain);
  EXPECT_EQ(again.covariance, twin.covariance);
  ASSERT_EQ(again.sessions.size(), 2u);
  EXPECT_EQ(again.sessions[0].values.size(), 3u);
  EXPECT_EQ(again.actuator.current_inertia, 0.0025);
  EXPECT_EQ(again.loop.late_share, 0.01);
}

TEST(Twin, IsAPlantFile) {
  const PlantFile file = ParsePlantFile(TwinText(SomeTwin()), "t.toml");
  EXPECT_EQ(file.plant.center2, 0.25);
  EXPECT_EQ(file.plant.coulomb1, 0.1);
  // One cycle of 2 ms, and delay and lag of the motors.
  const auto latency = std::ranges::find(file.conditions, "sensor_latency", &FlagValue::name);
  ASSERT_NE(latency, file.conditions.end());
  EXPECT_NEAR(std::stod(latency->text), 0.005, 1e-12);
  // A deviation of the lag is one of the latency.
  const auto posterior = std::ranges::find(file.conditions, "posterior", &FlagValue::name);
  ASSERT_NE(posterior, file.conditions.end());
  EXPECT_EQ(posterior->text, "center2 4e-06; zero1 1e-06 9e-04; sensor_latency 0 0 1e-08");
}

TEST(Twin, DrawsWithItsCovariance) {
  const Twin twin = SomeTwin();
  Rng rng(1, "test");
  constexpr int kDraws = 4000;
  double mean = 0, square = 0, product = 0;
  for (int i = 0; i < kDraws; ++i) {
    const Twin drawn = DrawTwin(twin, rng);
    const double c = drawn.plant.center2 - 0.25, z = drawn.sensors.zero1 - 0.01;
    mean += c / kDraws;
    square += z * z / kDraws;
    product += c * z / kDraws;
    EXPECT_EQ(drawn.plant.mass1, 0.5);
  }
  EXPECT_NEAR(mean, 0, 4 * 0.002 / std::sqrt(kDraws));
  EXPECT_NEAR(square, 9e-4, 0.1 * 9e-4);
  EXPECT_NEAR(product, 1e-6, 4 * 0.002 * 0.03 / std::sqrt(kDraws));
}

TEST(Twin, DrawsStayWithinTheRanges) {
  Twin twin = SomeTwin();
  twin.plant.coulomb1 = 0.001;
  twin.uncertain = {"coulomb1", "center2"};
  twin.covariance = {1, 0, 0, 1};
  Rng rng(1, "test");
  for (int i = 0; i < 100; ++i) {
    const Plant plant = DrawTwin(twin, rng).plant;
    EXPECT_GE(plant.coulomb1, 0);
    EXPECT_GT(plant.center2, 0);  // 0 is half of the length
  }
}

TEST(Twin, RefusesCovariancesThatAreNone) {
  const std::string plant = "[plant]\nmass1 = 1\n[covariance]\n";
  EXPECT_NE(MessageFor(plant + "mass1 = [-1]").find("mass1: expected a variance"),
            std::string::npos);
  for (const char* rows : {"mass1 = [1, 2]\nmass2 = [2, 1]", "mass1 = [0, 1]\nmass2 = [1, 1]"}) {
    EXPECT_NE(MessageFor(plant + rows).find("mass2: expected this and the rows above"),
              std::string::npos);
  }
  // Each pair is possible, but not all three.
  const std::string three =
      "mass1 = [1, 0.9, 0.9]\nmass2 = [0.9, 1, -0.9]\ninertia1 = [0.9, -0.9, 1]";
  EXPECT_NE(MessageFor(plant + three).find("positive semidefinite"), std::string::npos);
  EXPECT_NE(MessageFor(plant + "mass1 = [1, 0.5]\nmass2 = [0, 1]").find("symmetric"),
            std::string::npos);
  EXPECT_NE(MessageFor(plant + "mass1 = [1, 0]").find("list of 1"), std::string::npos);
  EXPECT_NE(MessageFor(plant + "mass1 = [nan]").find("finite"), std::string::npos);
  EXPECT_NE(MessageFor(plant + "mas1 = [1]").find("mass1"), std::string::npos);
  EXPECT_NE(MessageFor(plant + "damping = [1]").find("expected the name of one number"),
            std::string::npos);
}

TEST(Twin, RefusesHalfATableOfCogging) {
  const std::string plant = "[plant]\nmass1 = 1\n[cogging]\n";
  EXPECT_EQ(MessageFor(plant + "slots = 12\npoles = 14"), "");
  for (const char* half : {"slots = 12", "poles = 14", "sine1_slots = 0.05"}) {
    EXPECT_NE(MessageFor(plant + half).find("[cogging]: expected slots and poles"),
              std::string::npos);
  }
}

TEST(Twin, EveryNumberCanHaveACovariance) {
  const Twin twin;
  const Options options = OptionsOf(twin);
  for (const Option& option : options.all()) {
    const bool is_number = option.step == 0;  // the number of a joint is none
    const std::string text = Concat("[plant]\n[covariance]\n", option.name, " = [0]");
    EXPECT_EQ(MessageFor(text).empty(), is_number) << option.name;
  }
}

TEST(Twin, RefusesUnknownNamesAndRanges) {
  EXPECT_NE(MessageFor("[actuator]\nlagg = 1").find("did you mean lag"), std::string::npos);
  EXPECT_NE(MessageFor("[actuator]\nlag = 5").find("t.toml:2"), std::string::npos);
  EXPECT_NE(MessageFor("name = 3").find("a text"), std::string::npos);
  EXPECT_NE(MessageFor("[sessions]\na = 1").find("a table"), std::string::npos);
  EXPECT_NE(MessageFor("[sessions.day]\nzero = 1").find("t.toml:2"), std::string::npos);
  EXPECT_NE(MessageFor("[actuator]\nlag = 0.01").find("[plant]"), std::string::npos);
}

TEST(SessionOf, LeavesOutTheLastNumberAndFarFolders) {
  EXPECT_EQ(SessionOf("/data/2023/C.1/pushed/acrobot-07.csv.gz"), "C.1/pushed/acrobot-");
  EXPECT_EQ(SessionOf("C.1/pushed/acrobot-01.csv"), "C.1/pushed/acrobot-");
  EXPECT_EQ(SessionOf("run12.csv"), "run");
  EXPECT_EQ(SessionOf("20230629-143339.csv.gz"), "20230629-");
  EXPECT_EQ(SessionOf("day2/log.csv"), "day2/log");
  EXPECT_EQ(SessionOf("log"), "log");
}

TEST(InSession, TakesTheSessionsValues) {
  const Twin twin = SomeTwin();
  MachineLog log;
  log.name = "day/run-3.csv";
  EXPECT_EQ(InSession(twin, log).plant.coulomb1, 0.12);
  EXPECT_EQ(InSession(twin, log).sensors.zero2, -0.03);
  EXPECT_EQ(InSession(twin, log).uncertain, (std::vector<std::string>{"center2", "lag"}));
  EXPECT_EQ(InSession(twin, log).covariance, (std::vector<double>{4e-6, 0, 0, 1e-8}));
  log.name = "day/unknown.csv";
  EXPECT_EQ(InSession(twin, log).plant.coulomb1, 0.1);
}

}  // namespace
}  // namespace upswing::machine
