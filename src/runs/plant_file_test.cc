#include "runs/plant_file.h"

#include <gtest/gtest.h>

#include "base/error.h"
#include "base/text.h"
#include "pendulum/scale.h"
#include "runs/config_files.h"

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
damping1 = [4e-4, 1e-6, 2e-8, 0]
delay = [1e-6, 9e-8, 1e-9, 0]
lag = [2e-8, 1e-9, 4e-8, 0]
zero1 = [0, 0, 0, 9e-4]
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
  ASSERT_EQ(file.conditions.size(), 3);
  EXPECT_EQ(file.conditions[0].name, "delay");
  EXPECT_EQ(file.conditions[0].where, "m.toml:9: delay");
  EXPECT_EQ(file.conditions[1].text, "4096");
  // Variances of delay and lag, and twice their covariance: 9e-8 + 4e-8 + 2 · 1e-9.
  EXPECT_EQ(file.conditions[2].name, "posterior");
  EXPECT_EQ(file.conditions[2].text, "damping1 4e-04; zero1 0 9e-04; sensor_latency 1.02e-06 0 1.32e-07");
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
  EXPECT_NE(ErrorOf("[plant]\nmass1 = 1e6").find("m.toml:2: mass1: expected a number in"),
            std::string::npos);
  EXPECT_EQ(ErrorOf("[plant]\nmass1 = \"1\""),
            "m.toml:2: mass1: expected a number in [0.001, 100000] kg, got the text \"1\"");
  EXPECT_NE(ErrorOf("[plant]\ndelay = 0.02").find("expected in section [disturbance]"),
            std::string::npos);
  EXPECT_NE(ErrorOf("mass1 = 1\n[plant]").find("expected in section [plant]"), std::string::npos);
  EXPECT_EQ(ErrorOf("[sensors]"), "m.toml: expected a table [plant], got none");
  EXPECT_EQ(ErrorOf("plant = 1"), "m.toml:1: expected a table [plant], got another type");
  EXPECT_EQ(ErrorOf("[[plant]]"), "m.toml:1: expected a table [plant], got another type");
}

TEST(PlantFile, RefusesACovarianceThatIsNone) {
  const std::string plant = "[plant]\n[covariance]\n";
  EXPECT_NE(ErrorOf(plant + "mass1 = [1, 0]").find("m.toml:3: mass1: expected a list of 1"),
            std::string::npos);
  EXPECT_NE(ErrorOf(plant + "mass1 = [nan]").find("finite"), std::string::npos);
  EXPECT_NE(ErrorOf(plant + "mass1 = [1, 0.5]\nmass2 = [0, 1]").find("symmetric"),
            std::string::npos);
  EXPECT_NE(ErrorOf("covariance = 1\n[plant]").find("expected a table"), std::string::npos);
  EXPECT_NE(ErrorOf(plant + "mass1 = [-1]").find("m.toml: [covariance]: expected a positive"),
            std::string::npos);
  EXPECT_NE(ErrorOf(plant + "mass1 = [1e-4, 1]\nmass2 = [1, 1e-4]").find("positive"),
            std::string::npos);
  // An alias is two numbers, and a joint is none.
  for (const char* name : {"damping", "mass", "actuated_joint", "mas1", "sensor_latency"}) {
    EXPECT_NE(ErrorOf(plant + name + " = [1]")
                  .find(Concat("m.toml:3: [covariance]: expected the name of one number of a ",
                               "machine, got \"", name, "\"")),
              std::string::npos)
        << name;
  }
}

TEST(PlantFile, RefusesDeepAndLargeDocumentsBeforeTheyAreParsed) {
  const auto repeated = [](std::string_view part, int count) {
    std::string text;
    for (int i = 0; i < count; ++i) text += part;
    return text;
  };
  const std::string parts = repeated("a.", 31000) + "a";
  for (const std::string& text :
       {"[plant]\n" + parts + " = 1", "[" + parts + "]", "[[" + parts + "]]",
        repeated("\"a.\\\"\" . 'b#\"'.", 9) + "c = 1", "a = " + repeated("[", 17),
        "a = " + repeated("{a.b = [\n", 9), "a = \"\"\"\"\"[#\"\"\"\"\"\nb = " + repeated("[", 17),
        "a = '''#'\n'''''\nb = " + repeated("{c=", 17)}) {
    EXPECT_NE(ErrorOf(text).find(": expected lists, tables and dotted keys of at most 16 levels"),
              std::string::npos)
        << text.substr(0, 100);
  }
  EXPECT_EQ(ErrorOf(repeated("#", (1 << 20) + 1)),
            "m.toml: expected TOML of at most 1048576 bytes, got 1048577");
  // Brackets and dots in strings and comments, and numbers, have no depth.
  EXPECT_EQ(ErrorOf("[plant]  # " + repeated("[.{", 99) + "\nmass1 = 1.5\n[sessions.a]\nb = \"" +
                    repeated(".[{", 99) + "\"\nc = '''\n" + repeated("[.", 99) + "'''\nd = [" +
                    repeated("1.5, ", 99) + "]\ne = 'x' # \" '''\n"),
            "");
}

TEST(PlantFile, ItsCovarianceCanRandomizeATraining) {
  const std::vector<FlagValue> flags{{"randomize_posterior", "true"}};
  const auto with = [&](const std::string& plant) {
    std::vector<FlagValue> all = flags;
    all.push_back({"plant", plant});
    return BuildConfig("", all);
  };
  EXPECT_TRUE(with("realaigym-twin").randomization.MakePosterior().has_value());
  // The recorded configuration has it, too.
  const std::string text = ConfigToml(with("realaigym-twin"), false);
  EXPECT_EQ(ConfigIn(text, "config.toml").randomization.posterior,
            with("realaigym-twin").randomization.posterior);
  EXPECT_THROW(with("realaigym"), Error);
  EXPECT_THROW(BuildConfig("", flags), Error);
}

TEST(PlantFile, IsALayerBetweenAgentAndFlags) {
  const Config config = BuildConfig("", {{"mass2", "1.3"}, {"plant", "realaigym"}});
  EXPECT_EQ(config.plant.mass2, 1.3);
  EXPECT_EQ(config.plant.center1, 0.2);
  EXPECT_EQ(config.plant.torque_limit, 6);
  EXPECT_THROW(BuildConfig("", {{"plant", "realaigim"}}), Error);
}

TEST(PlantFile, EveryShippedPlantIsValid) {
  EXPECT_FALSE(EmbeddedPlants().empty());
  for (const std::string& name : NamesOf(EmbeddedPlants()))
    EXPECT_NO_THROW((void)ReadPlantFile(name)) << name;
}

TEST(PlantFile, OnlyCloudPendulumHasAnotherSizeThanTheBuiltInPlant) {
  std::vector<Plant> robots{Plant()};
  for (const char* name : {"realaigym", "realaigym-c1", "realaigym-twin"}) {
    robots.push_back(ReadPlantFile(name).plant);
  }
  const Plant small = ReadPlantFile("cloudpendulum").plant;
  for (const Plant& from : robots) {
    for (const Plant& robot : robots) EXPECT_EQ(CarryOver(from, robot), Scale());
    EXPECT_EQ(CarryOver(from, small), ScaleOf(small) / ScaleOf(from));
  }
}

}  // namespace
}  // namespace upswing
