#include "run/plant_file.h"

#include <gtest/gtest.h>

#include "core/error.h"
#include "run/config_files.h"

namespace upswing {
namespace {

constexpr const char* kMachine = R"([plant]
mass1 = 1.2
length = 0.4
center2 = 0.15
inertia2 = 0.02
armature = 0

[disturbance]
delay = 0.02
encoder_counts = 4096

[actuator]
anything = "belongs to others"

[covariance]
mass1 = [[1, 2], [2, 1]]
)";

std::string ErrorOf(const std::string& toml) {
  try {
    (void)ParsePlantFile(toml, "m.toml");
  } catch (const Error& error) {
    EXPECT_EQ(error.exit_code(), 2);
    return error.what();
  }
  return "";
}

TEST(PlantFile, HasThePlantAndTheDisturbanceOfAMachine) {
  const PlantFile file = ParsePlantFile(kMachine, "m.toml");
  EXPECT_EQ(file.plant.mass1, 1.2);
  EXPECT_EQ(file.plant.length1, 0.4);
  EXPECT_EQ(file.plant.length2, 0.4);
  EXPECT_EQ(file.plant.center2, 0.15);
  EXPECT_EQ(file.plant.inertia2, 0.02);
  EXPECT_EQ(file.plant.armature, 0);
  EXPECT_EQ(file.plant.mass2, Plant().mass2);
  ASSERT_EQ(file.disturbance.size(), 2);
  EXPECT_EQ(file.disturbance[0].name, "delay");
  EXPECT_EQ(file.disturbance[0].where, "m.toml:9: delay");
  EXPECT_EQ(file.disturbance[1].text, "4096");
}

TEST(PlantFile, ItsFlagsMakeThePlant) {
  const PlantFile file = ParsePlantFile(kMachine, "m.toml");
  Plant plant;
  plant.mass2 = 3;  // the file has every setting
  SetFlags(OptionsOf(plant), file.PlantFlags());
  EXPECT_EQ(PlantValues(plant), PlantValues(file.plant));
}

TEST(PlantFile, MistakesHaveTheirLineAndASuggestion) {
  EXPECT_NE(
      ErrorOf("[plant]\nmas1 = 1").find("m.toml:2: [plant]: expected a setting, got \"mas1\""),
      std::string::npos);
  EXPECT_NE(ErrorOf("[plant]\nmas1 = 1").find("did you mean mass1?"), std::string::npos);
  EXPECT_NE(ErrorOf("[plant]\nmass1 = 1\n[disturbence]").find("did you mean disturbance?"),
            std::string::npos);
  EXPECT_NE(ErrorOf("[plant]\nmass1 = 1000").find("m.toml:2: mass1: expected a number in"),
            std::string::npos);
  EXPECT_NE(ErrorOf("[plant]\nmass1 = \"1\"").find("m.toml:2: mass1"), std::string::npos);
  EXPECT_NE(ErrorOf("[plant]\ndelay = 0.02").find("expected in section [disturbance]"),
            std::string::npos);
  EXPECT_NE(ErrorOf("mass1 = 1\n[plant]").find("expected in section [plant]"), std::string::npos);
  EXPECT_EQ(ErrorOf("[sensors]"), "m.toml: expected a table [plant], got none");
  EXPECT_EQ(ErrorOf("plant = 1"), "m.toml: expected a table [plant], got none");
}

TEST(PlantFile, IsALayerBetweenAgentAndFlags) {
  const Config config = BuildConfig("", {{"mass2", "1.3"}, {"plant", "realaigym"}});
  EXPECT_EQ(config.plant.mass2, 1.3);
  EXPECT_EQ(config.plant.center1, 0.2);
  EXPECT_EQ(config.plant.torque_limit, 6);
  EXPECT_THROW(BuildConfig("", {{"plant", "realaigim"}}), Error);
}

TEST(PlantFile, EveryShippedPlantIsValid) {
  EXPECT_FALSE(ShippedPlants().empty());
  for (const std::string& name : ShippedPlants())
    EXPECT_NO_THROW((void)ReadPlantFile(name)) << name;
}

}  // namespace
}  // namespace upswing
