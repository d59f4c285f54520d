#include "base/json.h"

#include <gtest/gtest.h>

#include "base/error.h"

namespace upswing {
namespace {

using nlohmann::json;

TEST(Json, IntegersAreNeitherRoundedNorWrappedNorGuessed) {
  EXPECT_EQ(JsonInteger(json::parse("8")), 8);
  EXPECT_EQ(JsonInteger(json::parse("-9223372036854775808")), INT64_MIN);
  for (const char* bad : {"8.9", "8.0", "1e1", "true", "null", "\"8\"", "[8]",
                          "9223372036854775808", "18446744073709551615", "1e300"}) {
    EXPECT_FALSE(JsonInteger(json::parse(bad))) << bad;
  }
}

/// The message of the error that `read` throws.
template <typename Read>
std::string ErrorOf(const Read& read) {
  try {
    read();
  } catch (const Error& error) {
    EXPECT_EQ(error.exit_code(), 2);
    return error.what();
  }
  return "";
}

TEST(Json, MessagesHaveTheExpectedAndTheFoundValue) {
  const json object = ParseJsonObject(R"({"n": 4294967304, "x": 0.5, "t": "text", "l": [1, 2]})");
  EXPECT_EQ(JsonInteger(object, "n", 0, 1LL << 40), 4294967304);
  EXPECT_EQ(JsonNumber(object, "x"), 0.5);
  EXPECT_EQ(JsonText(object, "t"), "text");
  EXPECT_EQ(JsonList(object, "l", 2).size(), 2U);
  EXPECT_EQ(ErrorOf([&] { JsonInteger(object, "n", 1, 4096); }),
            "\"n\": expected an integer in [1, 4096], got 4294967304");
  EXPECT_EQ(ErrorOf([&] { JsonInteger(object, "x", 0, 1); }),
            "\"x\": expected an integer in [0, 1], got 0.5");
  EXPECT_EQ(ErrorOf([&] { JsonBool(object, "n"); }),
            "\"n\": expected true or false, got 4294967304");
  EXPECT_EQ(ErrorOf([&] { JsonText(object, "none"); }), "expected \"none\", found none");
  EXPECT_EQ(ErrorOf([&] { JsonList(object, "l", 1); }),
            "\"l\": expected a list of at most 1, got [1,2]");
}

TEST(Json, OnlyObjectsOfLimitedDepthAreAccepted) {
  for (const char* bad : {"", "[]", "3", "nonsense", "{", "{}x", "\xff"}) {
    EXPECT_EQ(ErrorOf([&] { ParseJsonObject(bad); }), "expected a JSON object") << bad;
  }
  EXPECT_EQ(ErrorOf([] { ParseJsonObject(R"({"a": {"b": [1]}})"); }), "");
  const std::string deep(500000, '[');
  for (const std::string& text : {R"({"a": {"b": [[1]]}})" + std::string(), "{\"a\": " + deep,
                                  "{\"a\": " + deep + std::string(deep.size(), ']') + "}"}) {
    EXPECT_EQ(ErrorOf([&] { ParseJsonObject(text); }), "expected JSON at most 3 levels deep");
  }
}

TEST(Json, AnObjectHasALimitedNumberOfParts) {
  std::string text = R"({"a": [{})";
  for (int i = 0; i < 999'995; ++i) text += ",{}";
  EXPECT_EQ(ParseJsonObject(text + "]}")["a"].size(), 999'996U);
  text += ",1, \"[{\\\"\"";
  EXPECT_EQ(ErrorOf([&] { ParseJsonObject(text + "]}"); }),
            "expected JSON of at most 1000000 names, values and lists");
}

TEST(Json, PrintedJsonIsAscii) {
  const nlohmann::ordered_json document{{"z", "\x1b° \xff"}, {"a", 0.5}};
  EXPECT_EQ(PrintableJson(document), "{\n  \"z\": \"\\u001b\\u00b0 \\ufffd\",\n  \"a\": 0.5\n}");
}

}  // namespace
}  // namespace upswing
