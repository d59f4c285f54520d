#include "base/policy_info.h"

#include <gtest/gtest.h>

#include "base/error.h"

namespace upswing {
namespace {

using Metadata = std::map<std::string, std::string>;

const Metadata kWhole{
    {"agent", "d3qn"},
    {"upswing_version", "0.3.0"},
    {"config", "[agent]\ngamma = 0.99\n"},
    {"seed", "7"},
    {"step", "1000000000000"},
    {"success_rate", "0.99"},
    {"mean_return", "-12.5"},
    {"plant", R"({"gravity":9.81,"mass1":1.0})"},
    {"control_period", "0.02"},
    {"observation", R"({"max_velocity":[10.0,20.0],"memory":{"names":["a"],"steps":2,)"
                    R"("torque":5.0,"velocity":1.0},"names":["cos q1"]})"},
    {"gamma", "0.99"},
    {"reward_scale", "0.1"},
};

TEST(PolicyInfo, HoldsTheMetadata) {
  const PolicyInfo info = ParsePolicyInfo(kWhole, "a");
  EXPECT_EQ(info.agent, "d3qn");
  EXPECT_EQ(info.seed, 7);
  EXPECT_EQ(info.step, 1000000000000);
  EXPECT_EQ(info.success_rate, 0.99);
  EXPECT_EQ(info.mean_return, -12.5);
  EXPECT_EQ(info.plant.at("gravity"), 9.81);
  EXPECT_EQ(info.control_period, 0.02);
  EXPECT_EQ(info.observation->max_velocity, (std::vector<double>{10, 20}));
  EXPECT_EQ(info.observation->memory->steps, 2);
  EXPECT_EQ(info.gamma, 0.99);
  EXPECT_EQ(info.reward_scale, 0.1);
  EXPECT_EQ(PolicyMetadata(info), kWhole);
}

TEST(PolicyInfo, MissingMetadataAreEmptyAndNotWritten) {
  const PolicyInfo info = ParsePolicyInfo({{"another", "key"}}, "a");
  EXPECT_EQ(info.agent, "");
  EXPECT_FALSE(info.seed || info.step || info.success_rate || info.mean_return);
  EXPECT_FALSE(info.control_period || info.observation || info.gamma || info.reward_scale);
  EXPECT_TRUE(PolicyMetadata(info).empty());
}

TEST(PolicyInfo, EachIsCheckedAndNamed) {
  const std::vector<std::pair<std::string, std::vector<std::string>>> bad{
      {"agent", {std::string(65, 'a'), "a\nself-check  passed", "\x1b[2J"}},
      {"upswing_version", {std::string(100, '1'), "0.3.0\r"}},
      {"seed", {"nan", "1e19", "-1", "7.5", "", "99999999999999999999", "9000000000000001"}},
      {"step", {"nan", "1e19", "-1", "many"}},
      {"success_rate", {"nan", "1e19", "-0.1", "1.1", "inf", "all"}},
      {"mean_return", {"nan", "1e61", "-inf", "high"}},
      {"control_period", {"0", "banana", "nan", "inf", "-0.02", "", "0.02 s"}},
      {"plant", {"nonsense", "[]", R"({"mass1":"1"})", R"({"mass1":1e999})", R"({"m":[[[[1]]]]})"}},
      {"observation",
       {"nonsense", "{}", R"({"names":["a"],"max_velocity":["fast"]})",
        R"({"names":[1],"max_velocity":[10,20]})",
        R"({"names":["a"],"max_velocity":[10,20],"memory":{"names":["a"],"steps":2.5,)"
        R"("torque":5.0,"velocity":1.0}})",
        R"({"names":["a"],"max_velocity":[10,20],"memory":3})"}},
      {"gamma", {"nan", "1.5", "-1", "x"}},
      {"reward_scale", {"0", "nan", "inf", "-0.1", "1e19"}},
  };
  for (const auto& [key, texts] : bad) {
    for (const std::string& text : texts) {
      Metadata metadata = kWhole;
      metadata[key] = text;
      try {
        ParsePolicyInfo(metadata, "a file");
        ADD_FAILURE() << key << " = " << text;
      } catch (const Error& error) {
        EXPECT_EQ(error.exit_code(), 2);
        EXPECT_EQ(std::string(error.what()).find("a file: metadata \"" + key + "\": "), 0U)
            << error.what();
      }
    }
  }
}

}  // namespace
}  // namespace upswing
