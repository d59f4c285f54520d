#include "pendulum/start_text.h"

#include <array>
#include <cmath>
#include <numbers>
#include <optional>
#include <vector>

#include "base/error.h"
#include "base/text.h"

namespace upswing {
namespace {

constexpr double kDegree = std::numbers::pi / 180;  // rad
constexpr double kLargestBare = 4 * std::numbers::pi;
using Units = std::array<std::string_view, 3>;
constexpr Units kAngleUnits{"deg", "°", "rad"}, kVelocityUnits{"deg/s", "°/s", "rad/s"};

/// A finite number and the unit after it, which may be empty.
struct Quantity {
  double number;
  std::string_view unit;
};

/// The number and its unit, one of `units`; nothing for another text.
std::optional<Quantity> Parse(std::string_view text, const Units& units) {
  text = Trim(text);
  std::string_view unit;
  for (const std::string_view each : units) {
    if (text.ends_with(each) && each.size() > unit.size()) unit = each;
  }
  text.remove_suffix(unit.size());
  const auto number = ParseNumber(Trim(text));
  if (!number || !std::isfinite(*number)) return std::nullopt;
  return Quantity{*number, unit};
}

/// An angle with its unit, "" for rad. Throws BadInput.
Quantity ParseAnyAngle(std::string_view text, const std::string& where) {
  const auto angle = Parse(text, kAngleUnits);
  if (!angle) {
    throw BadInput(Concat(where, ": expected an angle such as 3.14 [rad] or 180deg, got \"",
                          Printable(text), "\""));
  }
  if (angle->unit.empty() && std::abs(angle->number) > kLargestBare) {
    const std::string number = FormatNumber(angle->number);
    throw BadInput(Concat(where,
                          ": expected an angle in rad within ±4π, or one with its unit, got ",
                          number, " (did you mean ", number, "deg? else write ", number, "rad)"));
  }
  return *angle;
}

bool IsDegrees(const Quantity& angle) { return angle.unit == "deg" || angle.unit == "°"; }

/// A number with four decimals at most, and 0 in place of -0.
std::string Short(double x) {
  constexpr double kDigits = 1e4;
  return FormatNumber(std::round(x * kDigits) / kDigits + 0.0);
}

}  // namespace

double ParseAngle(std::string_view text, const std::string& where) {
  const Quantity angle = ParseAnyAngle(text, where);
  return IsDegrees(angle) ? angle.number * kDegree : angle.number;
}

double ParseDegrees(std::string_view text, const std::string& where) {
  const Quantity angle = ParseAnyAngle(text, where);
  return IsDegrees(angle) ? angle.number : angle.number / kDegree;
}

double ParseVelocity(std::string_view text, const std::string& where) {
  const auto velocity = Parse(text, kVelocityUnits);
  if (!velocity) {
    throw BadInput(Concat(where, ": expected a velocity such as 1.5 [rad/s] or 90deg/s, got \"",
                          Printable(text), "\""));
  }
  const bool in_radians = velocity->unit.empty() || velocity->unit == "rad/s";
  return in_radians ? velocity->number : velocity->number * kDegree;
}

PendulumState ParseState(const std::string& text, const std::string& where) {
  const std::vector<std::string_view> pieces = Split(text, ',');
  bool is_state = pieces.size() == 4;
  for (size_t i = 0; is_state && i < pieces.size(); ++i) {
    is_state = Parse(pieces[i], i < 2 ? kAngleUnits : kVelocityUnits).has_value();
  }
  if (!is_state) {
    throw BadInput(Concat(where, ": expected 4 numbers q1,q2,w1,w2, such as 3.14,0,0,0 or ",
                          "180deg,0,90deg/s,0, got \"", Printable(text), "\""));
  }
  return {ParseAngle(pieces[0], where), ParseAngle(pieces[1], where),
          ParseVelocity(pieces[2], where), ParseVelocity(pieces[3], where)};
}

std::string StateText(const PendulumState& s) {
  return Concat("q1 ", Short(s.q1), ", q2 ", Short(s.q2), " rad (", Short(s.q1 / kDegree), "°, ",
                Short(s.q2 / kDegree), "°), w1 ", Short(s.w1), ", w2 ", Short(s.w2), " rad/s");
}

}  // namespace upswing
