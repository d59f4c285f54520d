#include "base/format.h"

#include <gtest/gtest.h>

namespace upswing {
namespace {

TEST(Format, PlainNumbersHaveNoExponent) {
  EXPECT_EQ(FormatPlain(0.148, 3), "0.148");
  EXPECT_EQ(FormatPlain(0.00015, 2), "0.00015");
  EXPECT_EQ(FormatPlain(-12.34, 3), "-12.3");
  EXPECT_EQ(FormatPlain(5, 3), "5");
  EXPECT_EQ(FormatPlain(9.996, 3), "10");
  EXPECT_EQ(FormatPlain(1250, 2), "1250");
  EXPECT_EQ(FormatPlain(0, 3), "0");
  EXPECT_EQ(FormatPlain(-1e-20, 3), "0");
}

TEST(Format, Percentages) {
  EXPECT_EQ(FormatPercent(1), "100%");
  EXPECT_EQ(FormatPercent(0.997), "100%");
  EXPECT_EQ(FormatPercent(0.123), "12%");
  EXPECT_EQ(FormatPercent(5.7e-6), "0.00057%");
  EXPECT_EQ(FormatPercent(20), "2000%");
}

}  // namespace
}  // namespace upswing
