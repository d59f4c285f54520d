#include "base/text.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>

namespace upswing {
namespace {

TEST(Text, ConcatJoinsTextsAndNumbers) {
  const std::string text = "a";
  EXPECT_EQ(Concat(text, std::string_view("b"), "c", 'd', true), "abcd1");
  EXPECT_EQ(Concat(-1, " ", int64_t{-9223372036854775807}, " ", ~uint64_t{0}),
            "-1 -9223372036854775807 18446744073709551615");
  EXPECT_EQ(Concat(1.0 / 3, " ", 0.1F, " ", 1e20, " ", -0.0, " ", 123456789.0),
            "0.333333 0.1 1e+20 -0 1.23457e+08");
  EXPECT_EQ(Concat(), "");
}

TEST(Text, NumbersRoundTripInTheirShortestForm) {
  for (const double x : {0.1, 1e-5, 1.0 / 3, -0.0, 5e-324, 1.7976931348623157e308, 2e22}) {
    const auto back = ParseNumber(FormatNumber(x));
    ASSERT_TRUE(back);
    EXPECT_EQ(*back, x);
  }
  EXPECT_EQ(FormatNumber(0.1), "0.1");
  EXPECT_EQ(FormatNumber(3), "3");
  EXPECT_EQ(FormatNumber(100000), "100000");
  EXPECT_EQ(FormatNumber(-2e14), "-200000000000000");
}

TEST(Text, NumbersAreReadWholeOrNotAtAll) {
  EXPECT_EQ(ParseNumber("+1.5"), 1.5);
  EXPECT_EQ(ParseInteger("-12"), -12);
  EXPECT_TRUE(std::isnan(*ParseNumber("nan")));
  for (const char* bad : {"", " 1", "1 ", "1x", "--1", "+-1", "1e", "abc"}) {
    EXPECT_FALSE(ParseNumber(bad)) << bad;
  }
  EXPECT_FALSE(ParseInteger("99999999999999999999"));
}

TEST(Text, IntegersMayBeWrittenAsAnyNumberThatIsExactlyOne) {
  EXPECT_EQ(ParseInteger("+7"), 7);
  EXPECT_EQ(ParseInteger("1e6"), 1000000);
  EXPECT_EQ(ParseInteger("-2.5e3"), -2500);
  EXPECT_EQ(ParseInteger("1.0"), 1);
  EXPECT_EQ(ParseInteger("9223372036854775807"), std::numeric_limits<int64_t>::max());
  for (const char* bad : {"1.5", "1e-1", "1e17", "inf", "nan", "1e", "e3", "0x10", "1 000"}) {
    EXPECT_FALSE(ParseInteger(bad)) << bad;
  }
}

TEST(Text, SplitTrimsAndKeepsEmptyPieces) {
  const auto pieces = Split(" a, ,b\r", ',');
  ASSERT_EQ(pieces.size(), 3U);
  EXPECT_EQ(pieces[0], "a");
  EXPECT_EQ(pieces[1], "");
  EXPECT_EQ(pieces[2], "b");
}

TEST(Text, SuggestsTheNearestNameOnlyIfItIsNear) {
  const std::vector<std::string> names{"gamma", "batch", "eval_every"};
  EXPECT_EQ(DidYouMean("gama", names), " (did you mean gamma?)");
  EXPECT_EQ(DidYouMean("PPO", {"sac", "ppo"}), " (did you mean ppo?)");
  EXPECT_EQ(DidYouMean("mas2", {"mass", "mass1", "mass2"}), " (did you mean mass2?)");
  EXPECT_EQ(DidYouMean("eval-evry", names), " (did you mean eval_every?)");
  EXPECT_EQ(DidYouMean("--lr", {"--layers", "--learning-rate"}),
            " (did you mean --learning-rate?)");
  EXPECT_EQ(DidYouMean("evaluate", {"train", "eval"}), " (did you mean eval?)");
  EXPECT_EQ(DidYouMean("max_steps", {"steps", "seed"}), " (did you mean steps?)");
  EXPECT_EQ(DidYouMean("--max-steps", {"--steps"}), " (did you mean --steps?)");
  EXPECT_EQ(DidYouMean("simul", {"eval", "simulate"}), " (did you mean simulate?)");
  EXPECT_EQ(DidYouMean("qw", {"qwerty"}), "");
  EXPECT_EQ(DidYouMean("--yield", {"--y"}), "");
  EXPECT_EQ(DidYouMean("zzzzzz", names), "");
  EXPECT_EQ(DidYouMean("gamma", {}), "");
}

TEST(Text, NoNameIsMeantByALongWord) {
  const std::string long_name(100, 'a');
  EXPECT_EQ(DidYouMean(long_name + "b", {long_name}), "");
}

TEST(Text, TakesLineAfterLine) {
  std::string_view rest = "a\r\n\n b";
  EXPECT_EQ(TakeLine(rest), "a");
  EXPECT_EQ(TakeLine(rest), "");
  EXPECT_EQ(TakeLine(rest), "b");
  EXPECT_TRUE(rest.empty());
}

TEST(Text, OneLineLeavesOutTheMiddle) {
  EXPECT_EQ(OneLine("a\nb"), "a\\nb");
  const std::string line = OneLine("begin" + std::string(100'000, 'x') + "end");
  EXPECT_LT(line.size(), 2100);
  EXPECT_TRUE(line.starts_with("begin") && line.ends_with("end"));
}

TEST(Text, PrintableKeepsTextAndEscapesControlCharacters) {
  EXPECT_EQ(Printable("N·m θ₁ 漢 😀 C:\\x"), "N·m θ₁ 漢 😀 C:\\x");
  EXPECT_EQ(Printable("a\nb\rc\td"), "a\\nb\\rc\\td");
  EXPECT_EQ(Printable("\x1b[2J\x07\x7f"), "\\x1b[2J\\x07\\x7f");
  EXPECT_EQ(Printable(std::string_view("\0", 1)), "\\x00");
  EXPECT_EQ(Printable("\u009b31m"), "\\u009b31m");  // a control sequence in one character
  EXPECT_EQ(Printable("\u202egnp"), "\\u202egnp");  // right-to-left override
  EXPECT_EQ(Printable("\U000e0041"), "\\U000e0041");
  EXPECT_EQ(Printable("\uffff"), "\\uffff");  // not a character, and not allowed in XML
}

TEST(Text, PrintableEscapesEachByteThatIsNotUtf8) {
  EXPECT_EQ(Printable("\xff"), "\\xff");
  EXPECT_EQ(Printable("\xc3"), "\\xc3");                             // cut short
  EXPECT_EQ(Printable("\xc0\xaf"), "\\xc0\\xaf");                    // not the shortest form
  EXPECT_EQ(Printable("\xed\xa0\x80"), "\\xed\\xa0\\x80");           // half of a surrogate pair
  EXPECT_EQ(Printable("\xf4\x90\x80\x80"), "\\xf4\\x90\\x80\\x80");  // beyond Unicode
}

TEST(Text, ShellQuotedIsOneWordToAShell) {
  EXPECT_EQ(ShellQuoted("runs/d3qn-seed1"), "runs/d3qn-seed1");
  EXPECT_EQ(ShellQuoted(""), "''");
  EXPECT_EQ(ShellQuoted("x; touch y; $(id)"), "'x; touch y; $(id)'");
  EXPECT_EQ(ShellQuoted("it's"), "'it'\\''s'");
  EXPECT_EQ(ShellQuoted("~"), "'~'");
}

}  // namespace
}  // namespace upswing
