#include "extras/deploy/c_text.h"

#include <gtest/gtest.h>

#include <cmath>
#include <cstdlib>
#include <limits>

#include "base/rng.h"

namespace upswing::deploy {
namespace {

TEST(CText, NothingEndsAComment) {
  EXPECT_EQ(CommentText("fast, seed 1 (0.4.0)"), "fast, seed 1 (0.4.0)");
  EXPECT_EQ(CommentText("*/ @goal@ \\ ?"), "__ _goal_ _ _");
  std::string every;
  for (int c = 0; c < 256; ++c) every += static_cast<char>(c);
  const std::string safe = CommentText(every);
  EXPECT_EQ(safe.size(), every.size());
  EXPECT_EQ(safe.find_first_of("*/\\?\"'%@#<>\n\r\t"), std::string::npos);
  for (const char c : safe) EXPECT_TRUE(c >= ' ' && c <= '~');
}

TEST(CText, LiteralsReadBackAsTheSameFloat) {
  using Limits = std::numeric_limits<float>;
  EXPECT_EQ(CLiteral(1), "1.0f");
  EXPECT_EQ(CLiteral(-0.0F), "-0.0f");
  EXPECT_EQ(CLiteral(0.1F), "0.1f");
  std::vector<float> values{Limits::max(), Limits::min(), Limits::denorm_min(), 1e10F, -16777216};
  Rng rng(0, "literals");
  for (int i = 0; i < 1000; ++i) {
    values.push_back(static_cast<float>(rng.Normal() * std::pow(10, rng.Uniform(-30, 30))));
  }
  for (const float value : values) {
    const std::string literal = CLiteral(value);
    EXPECT_EQ(literal.back(), 'f');
    EXPECT_NE(literal.find_first_of(".e"), std::string::npos) << literal;
    EXPECT_EQ(std::strtof(literal.c_str(), nullptr), value) << literal;
  }
}

TEST(CText, WrapsBetweenWords) {
  const std::string text = Paragraph(std::string(300, 'x') + " y z");
  EXPECT_EQ(text, " * " + std::string(300, 'x') + "\n * y z");
}

}  // namespace
}  // namespace upswing::deploy
