#include "pendulum/own_reward.h"

#include <muParser.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <limits>
#include <numbers>
#include <utility>

#include "base/error.h"
#include "base/steps.h"
#include "base/text.h"
#include "pendulum/goal.h"
#include "pendulum/task.h"

namespace upswing {
namespace {

constexpr size_t kLongest = 1000;  // characters, which bounds the time of a step, too
constexpr size_t kMostTerms = 16, kLongestName = 24;
constexpr int kMostDepth = 16;  // parentheses within each other
constexpr double kLargest = 1e9;
constexpr std::string_view kLetters = "abcdefghijklmnopqrstuvwxyzABCDEFGHIJKLMNOPQRSTUVWXYZ";
constexpr std::string_view kInNames = "0123456789_", kOperators = " .,;:?()+-*/^<>=!&|";
constexpr size_t kNone = std::string_view::npos;
// Columns of episodes.csv, in which each term has one, too.
const std::vector<std::string> kTaken{"step", "episode", "return", "length", "terminated"};

constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();

/// 0 if x is 0, else 1; NaN if x is NaN.
double Truth(double x) {
  if (std::isnan(x)) return x;
  return x != 0 ? 1 : 0;
}

/// a and b; NaN if one of them that decides is NaN.
double And(double a, double b) {
  if (std::isnan(a) || a == 0) return a;
  return Truth(b);
}
double Or(double a, double b) {
  if (std::isnan(a)) return a;
  if (a != 0) return 1;
  return Truth(b);
}

/// A comparison; NaN if an operand is.
template <typename Comparison>
double Compare(double a, double b) {
  if (std::isnan(a) || std::isnan(b)) return kNaN;
  return Comparison()(a, b) ? 1 : 0;
}

/// The smaller and the larger argument; NaN if an argument is.
double Min(double a, double b) {
  if (std::isnan(a)) return a;
  return a < b ? a : b;
}
double Max(double a, double b) {
  if (std::isnan(a)) return a;
  return a > b ? a : b;
}

/// aᵇ; a square is the product, which is exact to rounding and fast.
double Power(double a, double b) { return b == 2 ? a * a : std::pow(a, b); }

/// Thrown while an expression is evaluated: the condition of ?: is NaN.
struct ConditionIsNaN {};

/// The operator that stands between a condition and its `?`; users cannot type it.
constexpr const char* kCheck = "#";
double CheckCondition(double condition, double /*unused*/) {
  if (std::isnan(condition)) throw ConditionIsNaN();
  return condition;
}

/// x within low … high; NaN if an argument is.
double Clamp(double x, double low, double high) {
  if (std::isnan(low) || std::isnan(high)) return kNaN;
  if (x < low) return low;
  return x > high ? high : x;
}

/// Defines the operators of an expression in place of muParser's own. Those evaluate constants by
/// other rules than variables (0.5 && 1 is 0), and NaN is true.
void DefineOperators(mu::Parser& parser) {
  struct Operator {
    const char* name;
    double (*function)(double, double);
    int precedence;
  };
  constexpr Operator kOperators[] = {
      {kCheck, CheckCondition, 0},
      {"||", Or, mu::prLOR},
      {"&&", And, mu::prLAND},
      {"<", Compare<std::less<>>, mu::prCMP},
      {"<=", Compare<std::less_equal<>>, mu::prCMP},
      {">", Compare<std::greater<>>, mu::prCMP},
      {">=", Compare<std::greater_equal<>>, mu::prCMP},
      {"==", Compare<std::equal_to<>>, mu::prCMP},
      {"!=", Compare<std::not_equal_to<>>, mu::prCMP},
      {"+", [](double a, double b) { return a + b; }, mu::prADD_SUB},
      {"-", [](double a, double b) { return a - b; }, mu::prADD_SUB},
      {"*", [](double a, double b) { return a * b; }, mu::prMUL_DIV},
      {"/", [](double a, double b) { return a / b; }, mu::prMUL_DIV},
  };
  parser.EnableBuiltInOprt(false);
  for (const auto& [name, function, precedence] : kOperators) {
    parser.DefineOprt(name, function, static_cast<unsigned>(precedence));
  }
  parser.DefineOprt("^", Power, mu::prPOW, mu::oaRIGHT);
}

/// Defines the functions and constants of an expression in place of muParser's own, and returns
/// their names.
std::vector<std::string> DefineFunctions(mu::Parser& parser) {
  using One = double (*)(double);
  using Two = double (*)(double, double);
  using Three = double (*)(double, double, double);
  constexpr std::pair<const char*, One> kOne[] = {
      {"sin", std::sin},   {"cos", std::cos},   {"tan", std::tan},   {"asin", std::asin},
      {"acos", std::acos}, {"atan", std::atan}, {"tanh", std::tanh}, {"exp", std::exp},
      {"log", std::log},   {"sqrt", std::sqrt}, {"abs", std::fabs},  {"wrap", Wrapped}};
  constexpr std::pair<const char*, Two> kTwo[] = {
      {"atan2", std::atan2}, {"min", Min}, {"max", Max}};
  constexpr std::pair<const char*, Three> kThree[] = {{"clamp", Clamp}, {"fma", std::fma}};
  parser.ClearFun();
  parser.ClearConst();
  parser.DefineConst("pi", std::numbers::pi);
  std::vector<std::string> names{"pi"};
  const auto define = [&](const auto& functions) {
    for (const auto& [name, function] : functions) {
      parser.DefineFun(name, function);
      names.emplace_back(name);
    }
  };
  define(kOne);
  define(kTwo);
  define(kThree);
  return names;
}

/// The name before the colon of a term, which is removed from it; empty if there is none.
std::string TakeName(std::string_view& term) {
  const size_t end = std::min(term.find_first_of("?:"), term.size());
  if (end == term.size() || term[end] == '?') return "";
  const std::string name(Trim(term.substr(0, end)));
  const bool fits = !name.empty() && name.size() <= kLongestName &&
                    name.find_first_not_of(Concat(kLetters, kInNames)) == kNone;
  if (!fits || std::ranges::find(kTaken, name) != kTaken.end()) {
    throw BadInput(Concat("reward: expected as a term's name 1 to ", kLongestName,
                          " letters, digits or _, and none of ", Join(kTaken, ", "), ", got \"",
                          name, "\""));
  }
  term.remove_prefix(end + 1);
  return name;
}

/// Throws BadInput if an expression is too long or too deep, or has characters of strings,
/// assignments or other languages.
void CheckText(const std::string& text) {
  if (text.size() > kLongest) {
    throw BadInput(Concat("reward: expected at most ", kLongest, " characters, got ", text.size()));
  }
  const size_t at = text.find_first_not_of(Concat(kLetters, kInNames, kOperators));
  if (at != kNone) {
    throw BadInput(Concat("reward: expected letters, digits, _ and", kOperators, ", got \"",
                          Printable(text.substr(at, 1)), "\""));
  }
  int depth = 0;
  for (size_t i = 0; i < text.size(); ++i) {
    if (text[i] == '(') ++depth;
    if (text[i] == ')') --depth;
    if (depth > kMostDepth) {
      throw BadInput(Concat("reward: expected at most ", kMostDepth,
                            " parentheses within each other, got more"));
    }
    // A comparison is ==, <=, >= or !=.
    if (text[i] != '=' || (i > 0 && std::string_view("=<>!").find(text[i - 1]) != kNone)) continue;
    if (text[i + 1] == '=') continue;
    throw BadInput("reward: expected an expression without assignment, got =; use == to compare");
  }
}

}  // namespace

/// The terms as parsers, and the variables that they read.
struct OwnReward::Parsed {
  Parsed() = default;
  Parsed(const Parsed&) = delete;  // the parsers point to the variables

  /// Adds a term. Throws BadInput that begins with `where`.
  void Add(std::string_view text, const std::string& where);
  /// The value of a term for the present variables; NaN if a condition in it is NaN.
  double Value(size_t term) const;
  /// The sum of all terms for the present variables, and of their absolute values.
  struct Sum {
    double reward = 0, size = 0;
  };
  Sum Total() const;
  /// Sets the variables to a random moment of a random episode.
  void Draw(const Plant& drawn, Rng& rng);
  /// Negates angles, velocities and torques.
  void Mirror();
  /// The values of the variables, such as `q1 = 0.1, q2 = …`.
  std::string Values() const;
  /// The message about the value of a term for the present variables; empty if it is in range.
  std::string Problem(double value, const std::string& name) const;

  PendulumState s;
  Plant plant;
  double control_period = kControlPeriod;  // s
  double E = 0, h = 0, inverted = 0, tau = 0, dtau = 0, upright = 0;
  const std::vector<std::pair<const char*, double*>> step{{"q1", &s.q1},   {"q2", &s.q2},
                                                          {"w1", &s.w1},   {"w2", &s.w2},
                                                          {"tau", &tau},   {"E", &E},
                                                          {"h", &h},       {"inverted", &inverted},
                                                          {"dtau", &dtau}, {"upright", &upright}};
  const Options parameters = OptionsOf(plant);
  std::vector<mu::Parser> terms;
};

void OwnReward::Parsed::Add(std::string_view text, const std::string& where) {
  mu::Parser& parser = terms.emplace_back();
  DefineOperators(parser);
  std::vector<std::string> names = DefineFunctions(parser);
  const auto define = [&](const std::string& name, double* variable) {
    parser.DefineVar(name, variable);
    names.push_back(name);
  };
  for (const auto& [name, variable] : step) define(name, variable);
  for (const Option& option : parameters.all()) {
    define(option.name, std::get<double*>(option.target));
  }
  try {
    parser.SetExpr(std::string(text));
    parser.Eval();
    if (parser.GetNumResults() != 1) {
      throw BadInput(Concat(where, "expected one expression, got ", parser.GetNumResults(),
                            " with commas between them; a semicolon separates terms"));
    }
    // Messages about the text above quote it as it is. Now each condition gets its check.
    std::string checked;
    for (const char c : text) checked += c == '?' ? Concat(kCheck, "0?") : std::string(1, c);
    parser.SetExpr(checked);
  } catch (const mu::ParserError& error) {
    const std::string& token = error.GetToken();
    if (error.GetCode() == mu::ecUNASSIGNABLE_TOKEN && kLetters.find(token[0]) != kNone) {
      const std::string hint = DidYouMean(token, names);
      throw BadInput(Concat(where, "expected a known name, got \"", token, "\"",
                            hint.empty() ? Concat("; known are ", Join(names, ", ")) : hint));
    }
    throw BadInput(
        Concat(where, "expected an expression, got \"", Trim(text), "\": ", error.GetMsg()));
  }
}

double OwnReward::Parsed::Value(size_t term) const {
  try {
    return terms[term].Eval();
  } catch (const ConditionIsNaN&) {
    return kNaN;
  }
}

OwnReward::Parsed::Sum OwnReward::Parsed::Total() const {
  Sum sum;
  for (size_t k = 0; k < terms.size(); ++k) {
    const double value = Value(k);
    sum.reward += value;
    sum.size += std::abs(value);
  }
  return sum;
}

void OwnReward::Parsed::Draw(const Plant& drawn, Rng& rng) {
  plant = drawn;
  // Half of the states are near a pose at rest. Magnitudes spread over several decades.
  const auto spread = [&](double lowest, double highest) {
    const double share = std::log(highest / lowest) * rng.Uniform();
    return rng.Uniform(-1, 1) * lowest * std::exp(share);
  };
  const PendulumState pose = RestIn(kPoses[rng.Below(4)]);
  const bool near = rng.Below(2) == 0;
  const double turn = 2 * std::numbers::pi;
  const auto angle = [&](double at_rest) {
    const double turns = rng.Below(4) == 0 ? std::floor(rng.Uniform(-3, 4)) : 0;
    return turn * turns + (near ? at_rest + spread(0.01, 0.5) : rng.Uniform(-turn / 2, turn / 2));
  };
  s = {angle(pose.q1), angle(pose.q2), spread(0.01, 50), spread(0.01, 50)};
  const double limit = plant.torque_limit;
  const auto torque = [&] { return std::clamp(rng.Uniform(-1.2, 1.2) * limit, -limit, limit); };
  tau = torque();
  dtau = tau - torque();
  const auto built_in = RewardTerms(plant, s, tau);
  E = built_in[0];
  h = built_in[1];
  inverted = static_cast<double>(rng.Below(2));
  upright = inverted * control_period * std::round(std::abs(spread(1, 1000)));
}

void OwnReward::Parsed::Mirror() {
  for (double* number : {&s.q1, &s.q2, &s.w1, &s.w2, &tau, &dtau}) *number = -*number;
}

std::string OwnReward::Parsed::Values() const {
  std::vector<std::string> values;
  for (const auto& [variable, number] : step) {
    values.push_back(Concat(variable, " = ", FormatNumber(*number)));
  }
  return Join(values, ", ");
}

std::string OwnReward::Parsed::Problem(double value, const std::string& name) const {
  if (std::abs(value) <= kLargest) return "";
  return Concat("reward: ", name, ": expected a number within ±1e9, got ",
                std::isnan(value) ? "nan" : FormatNumber(value), " at ", Values());
}

OwnReward::OwnReward(const std::string& expression, int num_envs, double control_period)
    : parsed_(std::make_unique<Parsed>()) {
  parsed_->control_period = control_period;
  CheckText(expression);
  for (std::string_view term : Split(expression, ';')) {
    std::string name = TakeName(term);
    if (name.empty()) name = Concat("term", names_.size() + 1);
    if (std::ranges::find(names_, name) != names_.end() || names_.size() == kMostTerms) {
      throw BadInput(Concat("reward: expected at most ", kMostTerms,
                            " terms with different names, got another \"", name, "\""));
    }
    names_.push_back(name);
    parsed_->Add(term, Concat("reward: ", name, ": "));
    const std::string problem = parsed_->Problem(parsed_->Value(names_.size() - 1), name);
    if (!problem.empty()) throw BadInput(problem);
  }
  const auto n = static_cast<size_t>(num_envs);
  built_in_.resize(n * kRewardTerms);
  last_torque_.resize(n);
  inverted_steps_.resize(n);
}

OwnReward::~OwnReward() = default;

std::string OwnReward::Asymmetry(const std::function<Plant(Rng&)>& draw) {
  constexpr int kMoments = 4096;
  constexpr double kRounding = 1e-9, kSmallest = 1e-12;
  Rng rng(1, "reward: mirror");
  Parsed& now = *parsed_;
  for (int i = 0; i < kMoments; ++i) {
    now.Draw(draw(rng), rng);
    const Parsed::Sum here = now.Total();
    now.Mirror();
    const Parsed::Sum there = now.Total();
    now.Mirror();
    const bool known_here = here.size <= kLargest;
    const bool known_there = there.size <= kLargest;
    if (!known_here && !known_there) continue;
    const double rounding = kRounding * (here.size + there.size) + kSmallest;
    const bool equal = std::abs(here.reward - there.reward) <= rounding;
    if (known_here && known_there && equal) continue;
    return Concat(here.reward, " at q1 = ", now.s.q1, ", q2 = ", now.s.q2, ", w1 = ", now.s.w1,
                  ", w2 = ", now.s.w2, ", tau = ", now.tau, ", but ", there.reward,
                  " at the mirror image");
  }
  return "";
}

void OwnReward::Begin(int env) {
  last_torque_[static_cast<size_t>(env)] = 0;
  inverted_steps_[static_cast<size_t>(env)] = 0;
}

void OwnReward::Judge(int env, const Plant& plant, const PendulumState& s, StepResult& result) {
  const auto i = static_cast<size_t>(env);
  Parsed& now = *parsed_;
  now.plant = plant;
  now.s = s;
  now.E = built_in_[i * kRewardTerms];
  now.h = built_in_[i * kRewardTerms + 1];
  now.inverted = result.at_goal[i];
  now.tau = result.torque[i];
  now.dtau = now.tau - last_torque_[i];
  last_torque_[i] = now.tau;
  if (result.at_goal[i] != 0) {
    ++inverted_steps_[i];
  } else {
    inverted_steps_[i] = 0;
  }
  now.upright = static_cast<double>(inverted_steps_[i]) * now.control_period;

  const size_t K = names_.size();
  result.reward[i] = 0;
  for (size_t k = 0; k < K; ++k) {
    const double value = now.Value(k);
    if (!(std::abs(value) <= kLargest)) throw Failure(now.Problem(value, names_[k]));
    result.reward_terms[i * K + k] = value;
    result.reward[i] += value;
  }
}

void OwnReward::State(const Archive& archive) {
  archive.Array("last_torque", std::span(last_torque_));
  archive.Array("inverted_steps", std::span(inverted_steps_), {0, kMostSteps});
}

}  // namespace upswing
