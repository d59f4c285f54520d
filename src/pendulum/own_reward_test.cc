#include "pendulum/own_reward.h"

#include <gtest/gtest.h>

#include <numeric>
#include <string>

#include "base/error.h"
#include "pendulum/testing.h"

namespace upswing {
namespace {

template <typename Work>
std::string MessageOf(const Work& work) {
  try {
    work();
  } catch (const Error& error) {
    return error.what();
  }
  return "no error";
}

TEST(OwnReward, NamesItsTerms) {
  EXPECT_EQ(OwnReward("E + h").names(), std::vector<std::string>{"term1"});
  EXPECT_EQ(OwnReward(" energy : E; inverted ? 5 : h; x_2: 1").names(),
            (std::vector<std::string>{"energy", "term2", "x_2"}));
}

TEST(OwnReward, OtherTextIsRefusedInOneLine) {
  const std::string deep(17, '(');
  std::string terms = "1";
  for (int i = 0; i < 16; ++i) terms += ";1";
  const std::pair<std::string, const char*> kWrong[] = {
      {"E + w3", "reward: term1: expected a known name, got \"w3\" (did you mean w1?)"},
      {"E; a: sinn(q1)", "reward: a: expected a known name, got \"sinn\" (did you mean sin?)"},
      {"rnd()", "got \"rnd\"; known are "},
      {"_pi", "Unexpected token"},
      {"w1 = 5", "without assignment"},
      {"E >= 1 = 2", "without assignment"},
      {"\"a\"", "expected letters, digits"},
      {"E\x01", "got \"\\x01\""},
      {"E, h", "got 2 with commas"},
      {"E;", "reward: term2: expected an expression"},
      {"E +", "Unexpected end"},
      {"E -> 1", "Unexpected token"},
      {"min(E)", "Too few"},
      {"1e999", "expected an expression, got \"1e999\""},
      {"1/0", "reward: term1: expected a number within ±1e9, got inf at q1 = 0, q2 = 0, w1 = 0"},
      {"1/w1", "got inf at q1 = 0"},
      {"0/0", "got nan"},
      {"2e9", "got 2000000000"},
      {"return: E", "expected as a term's name"},
      {"a b: E", "expected as a term's name"},
      {"a: E; a: h", "another \"a\""},
      {terms, "at most 16 terms"},
      {deep + "1" + std::string(17, ')'), "at most 16 parentheses"},
      {std::string(10'000, '1'), "at most 1000 characters, got 10000"},
  };
  for (const auto& [text, words] : kWrong) {
    const std::string message =
        MessageOf([&, &expression = text] { OwnReward reward(expression); });
    EXPECT_NE(message.find(words), std::string::npos) << text << ": " << message;
    EXPECT_EQ(message.find('\n'), std::string::npos);
  }
}

/// The reward of a control step with energy 0.25, height 0.75 and this torque and goal.
double Judge(OwnReward& reward, const PendulumState& s, double tau, bool inverted,
             const Plant& plant = {}) {
  EnvSpec spec;
  spec.action_limit = {5};
  spec.term_names = reward.names();
  StepResult result(spec);
  result.torque = {tau};
  result.at_goal = {static_cast<uint8_t>(inverted)};
  reward.SwapTerms(result);
  result.reward_terms = {0.25, 0.75, 0, 0, 0};
  reward.SwapTerms(result);
  reward.Judge(0, plant, s, result);
  EXPECT_EQ(result.reward[0],
            std::accumulate(result.reward_terms.begin(), result.reward_terms.end(), 0.0));
  return result.reward[0];
}

TEST(OwnReward, KnowsStatePlantAndHistory) {
  const PendulumState s{0.1, 0.2, 3, -4};
  const auto value = [&](const std::string& text) {
    OwnReward reward(text);
    Plant plant;
    plant.mass2 = 1.5;
    return Judge(reward, s, 2, true, plant);
  };
  EXPECT_EQ(value("q1 + 10*q2 + 100*w1 + 1000*w2"), 0.1 + 10 * 0.2 + 300 - 4000);
  EXPECT_EQ(value("E; 10*h; 100*inverted; 1000*tau"), 0.25 + 7.5 + 100 + 2000);
  EXPECT_EQ(value("mass2 + 10*torque_limit"), 51.5);
  EXPECT_EQ(value("min(q1, q2) + max(w1, w2) + clamp(w2, -1, 1) + abs(w2)"), 0.1 + 3 - 1 + 4);
  EXPECT_EQ(value("inverted && E < 0.5 ? -w2^2 : 7"), -16);
  EXPECT_NEAR(value("cos(pi) + atan2(1, 1) + wrap(7) + fma(2, 3, 4)"),
              -1 + kPi / 4 + 7 - 2 * kPi + 10, 1e-15);

  OwnReward reward("dtau; 100*upright");
  EXPECT_DOUBLE_EQ(Judge(reward, s, 2, true), 2 + 2);
  EXPECT_DOUBLE_EQ(Judge(reward, s, 5, true), 3 + 4);
  EXPECT_DOUBLE_EQ(Judge(reward, s, 4, false), -1 + 0);
  EXPECT_DOUBLE_EQ(Judge(reward, s, 4, true), 0 + 2);
  reward.Begin(0);
  EXPECT_DOUBLE_EQ(Judge(reward, s, 3, true), 3 + 2);
}

TEST(OwnReward, ConstantsAreEvaluatedLikeVariables) {
  const std::pair<const char*, double> kValues[] = {{"0.5 && 1", 1},
                                                    {"1 && 0.3", 1},
                                                    {"0.2 || 0", 1},
                                                    {"0 || 0.2", 1},
                                                    {"0.5 && 0", 0},
                                                    {"pi && 0.1", 1},
                                                    {"0.5 ? 2 : 3", 2},
                                                    {"(0.5 && 1) + 1", 2},
                                                    {"2 + 3*4 - 6/3", 12},
                                                    {"2^3^2", 512},
                                                    {"-2^2", -4},
                                                    {"2^-1", 0.5},
                                                    {"8/4/2", 1},
                                                    {"5 - 3 - 1", 1},
                                                    {"1 < 2 && 2 <= 2 && 3 > 2 && 3 >= 3", 1},
                                                    {"1 == 1 != 0", 1},
                                                    {"1 + 1 == 2", 1},
                                                    {"0 || 1 && 0", 0},
                                                    {"1 ? 0 ? 1 : 2 : 3", 2},
                                                    {"0 ? 1 : 0 ? 2 : 3", 3},
                                                    {"1 + (0 ? 1 : 2)*3", 7},
                                                    {"max(0 ? 1 : 2, 1 ? 3 : 4)", 3},
                                                    {"0 && 0/0", 0},
                                                    {"1 || 0/0", 1},
                                                    {"1 ? 1 : 0/0", 1}};
  for (const auto& [text, value] : kValues) {
    OwnReward constants(text);
    EXPECT_EQ(Judge(constants, {}, 0, false), value) << text;
    // The same numbers as variables.
    std::string variables(text);
    for (const auto& [number, name] : {std::pair("0.5", "w1"), {"0.3", "w2"}, {"0.2", "q1"}}) {
      const size_t at = variables.find(number);
      if (at != std::string::npos) variables.replace(at, 3, name);
    }
    OwnReward reward(variables);
    EXPECT_EQ(Judge(reward, {0.2, 0, 0.5, 0.3}, 0, false), value) << variables;
  }
}

TEST(OwnReward, NaNIsNeverTrueOrFalse) {
  for (const char* text :
       {"0/0 ? 1 : 2", "0/0 < 1", "1 >= 0/0", "0/0 == 0/0", "0/0 != 1", "0/0 && 0", "1 && 0/0",
        "0/0 || 1", "0 || 0/0", "1 + (sqrt(-1) ? 1 : 2)", "1 ? (0/0 > 1 ? 2 : 3) : 4",
        "clamp(1, 0/0, 2)", "clamp(1, 0, 0/0)", "min(1, 0/0)", "max(0/0, 1)"}) {
    const std::string message = MessageOf([&] { OwnReward reward(text); });
    EXPECT_NE(message.find("expected a number within ±1e9, got nan at"), std::string::npos)
        << text << ": " << message;
  }
  OwnReward reward("sqrt(1 - w1) > 0 ? 1 : 2");
  EXPECT_EQ(Judge(reward, {0, 0, -3, 0}, 1, false), 1);
  EXPECT_NE(MessageOf([&] {
              Judge(reward, {0, 0, 3, 0}, 1, false);
            }).find("got nan at q1 = 0"),
            std::string::npos);
  // Another evaluation works again.
  EXPECT_EQ(Judge(reward, {0, 0, 1, 0}, 1, false), 2);
}

TEST(OwnReward, KnowsWhetherMirrorImagesHaveTheSameReward) {
  const auto asymmetry = [](const std::string& text) {
    return OwnReward(text).Asymmetry([](Rng& /*rng*/) { return Plant(); });
  };
  for (const char* text :
       {"E + h + 5*inverted", "-0.01*tau^2", "w1*w2", "w1*tau", "abs(dtau)", "sin(q1)*w1",
        "a: w1; b: -w1", "a: 2 + w1; b: tau; c: -w1 - tau", "cos(q1 - pi) + cos(q1 + q2 - pi)",
        "wrap(q1 - pi)^2", "w1 < 0 ? -w1 : w1", "exp(-w1^2) + upright", "1e8 + w1*w1",
        "1 - cos(q1 - 2*pi)", "max(w1, -w1)"}) {
    EXPECT_EQ(asymmetry(text), "") << text;
  }
  for (const char* text : {"0.2*w1",
                           "E + 0.001*w2",
                           "q1",
                           "tau",
                           "dtau",
                           "tau > 4.9",
                           "sin(q1)",
                           "w1^3",
                           "w1 > 0",
                           "inverted*w1",
                           "inverted && upright > 5 ? w1 : 0",
                           "E > 1.4 ? w2 : 0",
                           "5 + 1e-6*q2",
                           "abs(q1 - 3) < 0.05 ? 1 : 0",
                           "a: w1; b: -w2",
                           "exp(w1/10)",
                           "q1 > 7 ? 1 : 0",
                           "tau == torque_limit ? 1 : 0",
                           "atan2(q1, q2 + 1)",
                           "wrap(q1 - 1)^2"}) {
    EXPECT_NE(asymmetry(text), "") << text;
  }
  const std::string example = asymmetry("0.2*w1");
  EXPECT_NE(example.find(" at q1 = "), std::string::npos) << example;
  EXPECT_NE(example.find(" at the mirror image"), std::string::npos) << example;
  // A difference of some drawn plants only.
  EXPECT_NE(OwnReward("mass1 > 1.2 ? w1 : 0").Asymmetry([](Rng& rng) {
    Plant plant;
    plant.mass1 = rng.Uniform(0.75, 1.25);
    return plant;
  }),
            "");
}

TEST(OwnReward, AValueThatIsNotFiniteShowsItsState) {
  OwnReward reward("E; bad: sqrt(1 - w1)");
  EXPECT_EQ(Judge(reward, {0, 0, -3, 0}, 1, false), 0.25 + 2);
  const std::string message = MessageOf([&] { Judge(reward, {0.5, 0, 3, 0}, 1, false); });
  EXPECT_EQ(message,
            "reward: bad: expected a number within ±1e9, got nan at q1 = 0.5, q2 = 0, w1 = 3, w2 = "
            "0, tau = 1, E = 0.25, h = 0.75, inverted = 0, dtau = 0, upright = 0");
}

}  // namespace
}  // namespace upswing
