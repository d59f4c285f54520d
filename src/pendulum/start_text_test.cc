#include "pendulum/start_text.h"

#include <gtest/gtest.h>

#include <numbers>

#include "base/error.h"

namespace upswing {
namespace {

constexpr double kHalfTurn = std::numbers::pi;

std::string StartMessage(const std::string& text) {
  try {
    (void)ParseState(text, "--start");
  } catch (const Error& error) {
    return error.what();
  }
  return "";
}

TEST(StartText, AnglesAndVelocitiesWithAndWithoutUnits) {
  EXPECT_DOUBLE_EQ(ParseAngle("180deg", ""), kHalfTurn);
  EXPECT_DOUBLE_EQ(ParseAngle("-90°", ""), -kHalfTurn / 2);
  EXPECT_DOUBLE_EQ(ParseAngle(" 3.5 rad ", ""), 3.5);
  EXPECT_DOUBLE_EQ(ParseAngle("3.5", ""), 3.5);
  EXPECT_DOUBLE_EQ(ParseAngle("-12.5", ""), -12.5);
  EXPECT_DOUBLE_EQ(ParseAngle("720deg", ""), 4 * kHalfTurn);
  EXPECT_DOUBLE_EQ(ParseAngle("100rad", ""), 100);
  EXPECT_EQ(ParseDegrees("178deg", ""), 178);
  EXPECT_DOUBLE_EQ(ParseDegrees("3.5", ""), 3.5 * 180 / kHalfTurn);
  EXPECT_DOUBLE_EQ(ParseVelocity("90deg/s", ""), kHalfTurn / 2);
  EXPECT_DOUBLE_EQ(ParseVelocity("90°/s", ""), kHalfTurn / 2);
  EXPECT_DOUBLE_EQ(ParseVelocity("40rad/s", ""), 40);
  EXPECT_DOUBLE_EQ(ParseVelocity("-40", ""), -40);
  const PendulumState state = ParseState("180deg,0.1,-90deg/s,2", "--start");
  EXPECT_DOUBLE_EQ(state.q1, kHalfTurn);
  EXPECT_DOUBLE_EQ(state.q2, 0.1);
  EXPECT_DOUBLE_EQ(state.w1, -kHalfTurn / 2);
  EXPECT_DOUBLE_EQ(state.w2, 2);
}

TEST(StartText, AnAngleThatIsMeantInDegreesIsRefused) {
  for (const std::string text : {"180,0,0,0", "0,180,0,0"}) {
    EXPECT_EQ(
        StartMessage(text),
        "--start: expected an angle in rad within ±4π, or one with its unit, got 180 (did you "
        "mean 180deg? else write 180rad)");
  }
  EXPECT_NE(StartMessage("-12.6,0,0,0"), "");
  EXPECT_EQ(StartMessage("12.56,-12.56,180,180"), "");
}

TEST(StartText, OtherTextsAreRefused) {
  for (const std::string text :
       {"", "1", "1,2,3", "1,2,3,4,5", "a,0,0,0", "0,0,0,1deg", "0,0,1rad,0", "1deg/s,0,0,0",
        "inf,0,0,0", "nan,0,0,0", "degrees,0,0,0", "deg,0,0,0", "1 2deg,0,0,0", "0,0,,0"}) {
    EXPECT_TRUE(StartMessage(text).starts_with("--start: expected ")) << text;
  }
}

TEST(StartText, AStateIsShownWithItsUnits) {
  EXPECT_EQ(StateText({kHalfTurn, -1e-9, 0.5, 0}),
            "q1 3.1416, q2 0 rad (180°, 0°), w1 0.5, w2 0 rad/s");
}

}  // namespace
}  // namespace upswing
