#include "base/options.h"

#include <gtest/gtest.h>

#include <algorithm>

#include "base/error.h"
#include "base/text.h"

namespace upswing {
namespace {

struct Sample {
  bool fast = true;
  int64_t count = 3;
  double rate = 0.5;
  std::string name = "x";
  std::vector<int64_t> widths = {4, 5};
  double mass1 = 1, mass2 = 2;

  void Describe(Options& o) {
    o.Section("one");
    o.Add(&fast, "fast", "be fast");
    o.Add(&count, "count", {1, 10}, "pieces", "how many");
    o.Add(&rate, "the_rate", kZeroToOne, "", "share");
    o.Section("two");
    o.Add(&name, "name", "a name");
    o.Add(&widths, "widths", {1, 100}, "layers");
    o.Add(&mass1, "mass1", kPositive, "kg", "mass");
    o.Add(&mass2, "mass2", kPositive, "kg", "mass");
    o.Alias("mass", {"mass1", "mass2"});
  }
};

class OptionsTest : public ::testing::Test {
 protected:
  OptionsTest() { sample_.Describe(options_); }
  std::string ErrorOf(const std::string& name, const std::string& text) {
    try {
      options_.Set(name, text, "here");
    } catch (const Error& error) {
      EXPECT_EQ(error.exit_code(), 2);
      return error.what();
    }
    return "no error";
  }
  Sample sample_;
  Options options_;
};

TEST_F(OptionsTest, SettingsOfAConstStructAreThoseOfACopy) {
  const Sample& constant = sample_;
  {
    const Options options = OptionsOf(constant);
    options.Set("count", "8", "here");
    EXPECT_EQ(options.Get("count")->text(), "8");
  }
  EXPECT_EQ(sample_.count, 3);
  const Option kept = *OptionsOf(constant).Get("count");  // outlives its Options
  EXPECT_EQ(kept.text(), "3");
}

TEST_F(OptionsTest, TomlHasControlCharactersAsEscapes) {
  options_.Set("name", "a\tb\x1b[0m\x7f\"°", "");
  EXPECT_EQ(options_.Get("name")->text(), R"("a\u0009b\u001B[0m\u007F\"°")");
  for (const char* text : {"a\nb", "a\rb"}) EXPECT_NE(ErrorOf("name", text), "no error");
}

TEST_F(OptionsTest, DescribeChangesNothing) {
  sample_.count = 7;
  const Sample& to_read = sample_;
  EXPECT_EQ(OptionsOf(to_read).Get("count")->text(), "7");
  EXPECT_EQ(sample_.count, 7);
}

TEST_F(OptionsTest, DifferencesAreInTheOrderOfTheSettingsWithBothValues) {
  const Sample defaults;
  EXPECT_TRUE(Differences(options_, OptionsOf(defaults)).empty());
  sample_.mass2 = 2.5;
  sample_.widths = {4};
  Options more = options_;
  int64_t extra = 1;
  more.Add(&extra, "extra", {0, 9}, "", "that the other lacks");
  const std::vector<Difference> found = Differences(more, OptionsOf(defaults));
  ASSERT_EQ(found.size(), 3);
  EXPECT_EQ(found[0].now.name, "widths");
  EXPECT_EQ(found[0].now.text(), "[4]");
  EXPECT_EQ(found[0].before->text(), "[4, 5]");
  EXPECT_EQ(found[1].now.number(), 2.5);
  EXPECT_EQ(found[1].before->number(), 2);
  EXPECT_EQ(found[2].now.name, "extra");
  EXPECT_FALSE(found[2].before);
}

TEST_F(OptionsTest, MinusZeroIsWrittenAsItIsRead) {
  options_.Set("the_rate", "-0", "");
  EXPECT_EQ(options_.Get("the_rate")->text(), "0");
}

TEST_F(OptionsTest, SetsEveryType) {
  options_.Set("fast", "false", "");
  options_.Set("count", "7", "");
  options_.Set("the_rate", "0.25", "");
  options_.Set("name", "a \"b\" c", "");
  options_.Set("widths", "[8, 9,10]", "");
  EXPECT_FALSE(sample_.fast);
  EXPECT_EQ(sample_.count, 7);
  EXPECT_EQ(sample_.rate, 0.25);
  EXPECT_EQ(sample_.name, "a \"b\" c");
  EXPECT_EQ(sample_.widths, (std::vector<int64_t>{8, 9, 10}));
  options_.Set("widths", "3", "");
  EXPECT_EQ(sample_.widths, (std::vector<int64_t>{3}));
}

TEST_F(OptionsTest, AnAliasSetsAllItsMembers) {
  options_.Set("mass", "4", "");
  EXPECT_EQ(sample_.mass1, 4);
  EXPECT_EQ(sample_.mass2, 4);
}

TEST_F(OptionsTest, MessagesHaveTheExpectedAndTheGivenValueAndThePlace) {
  EXPECT_EQ(ErrorOf("count", "11"), "here: expected an integer in [1, 10] pieces, got \"11\"");
  EXPECT_EQ(ErrorOf("count", "2.5"), "here: expected an integer in [1, 10] pieces, got \"2.5\"");
  EXPECT_EQ(ErrorOf("the_rate", "nan"), "here: expected a number in [0, 1], got \"nan\"");
  EXPECT_EQ(ErrorOf("fast", "yes"), "here: expected true or false, got \"yes\"");
  EXPECT_EQ(ErrorOf("widths", "4,x"), "here: expected a list of integers in [1, 100], got \"4,x\"");
  EXPECT_EQ(ErrorOf("cuont", "1"), "here: expected a setting, got \"cuont\" (did you mean count?)");
}

TEST_F(OptionsTest, ATextThatWrapsIsOnOneLine) {
  EXPECT_EQ(ErrorOf("name", "a\nb"), "here: expected a text, got \"a\nb\"");
  std::string text;
  Options options;
  options.Add(&text, "text", "a text").wraps = true;
  options.Set("text", "  E; h;\r\n\n   5*inverted;\n tau\n", "");
  EXPECT_EQ(text, "E; h; 5*inverted; tau");
}

TEST_F(OptionsTest, ARejectedValueLeavesNumbersAndListsAsTheyWere) {
  ErrorOf("count", "11");
  ErrorOf("widths", "4,x");
  EXPECT_EQ(sample_.count, 3);
  EXPECT_EQ(sample_.widths, (std::vector<int64_t>{4, 5}));
}

TEST(Choice, IsOneOfTheChoices) {
  std::string color = "red";
  Options options;
  options.AddChoice(&color, "color", {"red", "green"}, "of the pen");
  options.Set("color", "green", "--color");
  EXPECT_EQ(color, "green");
  try {
    options.Set("color", "blue", "--color");
    FAIL() << "blue was taken";
  } catch (const Error& error) {
    EXPECT_NE(std::string(error.what()).find("--color: expected one of red, green"),
              std::string::npos)
        << error.what();
  }
  EXPECT_EQ(color, "green");
}

TEST(Step, LetsThroughMultiplesAndNamesTheNearestOnes) {
  double pause = 0;
  Options options;
  options.Add(&pause, "pause", {0, 1}, "s", "between two steps").step = 0.02;
  for (int count = 0; count <= 50; ++count) {
    // Numbers as people write them, and as arithmetic rounds them.
    for (const double value :
         {count / 50.0, count * 0.02, std::max(0.0, 1 - (50 - count) * 0.02)}) {
      options.Set("pause", FormatNumber(value), "--pause");
      EXPECT_EQ(pause, value);
    }
  }
  const auto error_of = [&](const char* text) -> std::string {
    try {
      options.Set("pause", text, "--pause");
    } catch (const Error& error) {
      return error.what();
    }
    return "no error";
  };
  EXPECT_EQ(
      error_of("0.001"),
      "--pause: expected a multiple of 0.02 in [0, 1] s, got \"0.001\"; the nearest are 0 and "
      "0.02");
  EXPECT_EQ(
      error_of("0.6999"),
      "--pause: expected a multiple of 0.02 in [0, 1] s, got \"0.6999\"; the nearest are 0.68 "
      "and 0.7");
  EXPECT_EQ(error_of("1.001"), "--pause: expected a multiple of 0.02 in [0, 1] s, got \"1.001\"");
  EXPECT_EQ(pause, 1);
}

TEST_F(OptionsTest, OnACommandLine) {
  std::vector<std::string> words;
  for (const Option& option : options_.all()) words.push_back(option.on_command_line());
  EXPECT_EQ(Join(words, " "),
            "--fast --count 3 --the-rate 0.5 --name x --widths 4,5 --mass1 1 --mass2 2");
  options_.Set("fast", "false", "");
  EXPECT_EQ(options_.Find("fast", "").front()->on_command_line(), "--no-fast");
  options_.Set("name", "x; $(id)", "");
  EXPECT_EQ(options_.Find("name", "").front()->on_command_line(), "--name 'x; $(id)'");
}

TEST_F(OptionsTest, HelpHasUnitRangeAndDefault) {
  const auto find = [&](const char* name) { return *options_.Find(name, "").front(); };
  EXPECT_EQ(find("count").about(), "how many [pieces] (1 to 10)");
  EXPECT_EQ(find("count").about_with_default(), "how many [pieces] (1 to 10; default 3)");
  EXPECT_EQ(find("widths").about_with_default(), "layers (1 to 100; default 4,5)");
  EXPECT_EQ(find("name").about_with_default(), "a name (default x)");
  EXPECT_EQ(find("fast").about_with_default(), "be fast (default true)");
  options_.Set("name", "", "");
  EXPECT_EQ(find("name").about_with_default(), "a name");
  Option count = find("count");
  count.usual = "as many as there are";
  EXPECT_EQ(count.about_with_default(),
            "how many [pieces] (1 to 10; default as many as there are)");
  EXPECT_NE(options_.Toml(true, [](const Option&) { return true; })
                .find("count = 3  # how many [pieces] (1 to 10)\n"),
            std::string::npos);
}

TEST_F(OptionsTest, IntegersAreReadInOneWayWhereverTheyStand) {
  options_.Set("count", "1e1", "");
  EXPECT_EQ(sample_.count, 10);
  options_.Set("widths", "1e2,+3", "");
  EXPECT_EQ(sample_.widths, (std::vector<int64_t>{100, 3}));
  EXPECT_EQ(ErrorOf("count", "1e3"), "here: expected an integer in [1, 10] pieces, got \"1e3\"");
}

TEST_F(OptionsTest, FlagsAndTomlFollowFromTheSameLine) {
  EXPECT_EQ(options_.Find("the_rate", "").front()->flag(), "--the-rate");
  options_.Set("name", "a\\\"", "");
  EXPECT_EQ(options_.Toml(false, [](const Option&) { return true; }),
            "[one]\nfast = true\ncount = 3\nthe_rate = 0.5\n\n"
            "[two]\nname = \"a\\\\\\\"\"\nwidths = [4, 5]\nmass1 = 1\nmass2 = 2\n");
}

}  // namespace
}  // namespace upswing
