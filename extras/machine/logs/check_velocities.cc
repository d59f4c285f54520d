// Checks of the velocities against the angles.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numbers>

#include "base/text.h"
#include "extras/machine/logs/check.h"

namespace upswing::machine {
namespace {

/// Velocities of `joint` against central differences of the angle of `other`.
Pairs VelocityPairs(Pieces pieces, int joint, int other) {
  Pairs pairs;
  for (const MachineLog& piece : pieces) {
    for (int k = 1; k + 1 < piece.rows(); ++k) {
      pairs.Add(CentralDifference(piece, k, other), piece.velocity[k][joint]);
    }
  }
  return pairs;
}

/// A gain of velocities that indicates a wrong unit.
struct WrongUnit {
  double gain;
  const char* suspect;
};
constexpr double kDegree = std::numbers::pi / 180;
constexpr WrongUnit kWrongUnits[] = {
    {1 / kDegree, "velocities in deg/s"},
    {kDegree, "angles in degrees"},
    {60 / (2 * std::numbers::pi), "velocities in rpm"},
    {kDegree * 60 / (2 * std::numbers::pi), "angles in degrees and velocities in rpm"},
    {1 / (2 * std::numbers::pi), "velocities in turn/s"},
    {2 * std::numbers::pi, "angles in turns"},
    {1e3, "a clock in ms"},
    {1e6, "a clock in µs"}};

/// The meaning of a gain of the velocities.
std::string MeaningOf(double gain) {
  const auto distance = [&](const WrongUnit& unit) {
    return std::abs(std::abs(gain) / unit.gain - 1);
  };
  const WrongUnit& nearest = *std::ranges::min_element(kWrongUnits, {}, distance);
  if (distance(nearest) < 0.04) return Concat("suspect ", nearest.suspect, " (key unit)");
  return gain < 0 ? "opposite sign" : "suspect the unit or a gear";
}

/// The finite difference of the angle that equals a joint's velocities in at least 99% of the rows;
/// empty if none does.
std::string DifferenceOf(Pieces pieces, int joint) {
  struct Stencil {
    const char* name;
    int back, ahead;  // rows
  };
  for (const Stencil& stencil : {Stencil{"backward", 1, 0}, {"central", 1, 1}, {"forward", 0, 1}}) {
    double rows = 0, equal = 0;
    for (const MachineLog& piece : pieces) {
      for (int k = stencil.back; k + stencil.ahead < piece.rows(); ++k) {
        const int from = k - stencil.back, to = k + stencil.ahead;
        const double seconds = piece.time[to] - piece.time[from];
        const double difference = piece.angle[to][joint] - piece.angle[from][joint];
        const double v = piece.velocity[k][joint];
        rows += 1;
        equal += std::abs(v * seconds - difference) < 1e-6 * (seconds + std::abs(difference));
      }
    }
    if (rows > 10 && equal >= 0.99 * rows) return stencil.name;
  }
  return "";
}

/// Finds the largest velocity where the angle moves faster.
void CheckVelocityLimit(Pieces pieces, int joint, const Reporter& report) {
  const auto [low, high] = std::ranges::minmax(ValuesOf(pieces, &MachineLog::velocity, joint));
  const double limit = std::max(std::abs(low), std::abs(high));
  constexpr int kRows = 5;
  std::optional<LogRows> longest;
  int times = 0;
  for (const MachineLog& piece : pieces) {
    int first = 0;
    for (int k = 1; k < piece.rows(); ++k) {
      const bool last = k + 2 >= piece.rows();
      const bool clipped = !last && std::abs(piece.velocity[k][joint]) >= limit * (1 - 1e-9) &&
                           std::abs(CentralDifference(piece, k, joint)) > 1.03 * limit;
      if (clipped) continue;
      const int rows = k - 1 - first;  // from first + 1 to k - 1
      if (rows >= kRows) {
        ++times;
        const LogRows range = RangeOf(piece, first + 1, k - 1);
        if (!longest || range.last - range.first > longest->last - longest->first) longest = range;
      }
      first = k;
    }
  }
  if (!longest) return;
  std::string text = fmt::format("saturates at {:.4g} rad/s", limit);
  if (times > 1) text += fmt::format("; {} times, longest", times);
  report(Severity::kFault, text, longest, {{"limit", limit}, {"times", times}});
}

void CheckVelocity(Pieces pieces, int joint, const Reporter& report) {
  const auto add = [&](Severity severity, const std::string& text, const Pairs& pairs) {
    report(severity, text, {}, {{"gain", pairs.gain()}, {"correlation", pairs.correlation()}});
  };
  const Pairs own = VelocityPairs(pieces, joint, joint);
  const double r = own.correlation(), gain = own.gain();
  if (AngleRange(pieces, joint) < kMoves) {
    return add(Severity::kNote, "not compared: the joint hardly moves", own);
  }
  constexpr double kAgree = 0.8, kClear = 0.9, kBetter = 0.02;  // correlations
  const Pairs other = VelocityPairs(pieces, joint, 1 - joint);
  const double of_other = std::abs(other.correlation());
  const bool equals_other = of_other > 0.98 && std::abs(other.gain() - 1) < 0.1 &&
                            std::abs(gain - 1) > 0.3;  // also where the joints move in proportion
  if ((equals_other || of_other > std::max(kClear, std::abs(r) + kBetter)) &&
      AngleRange(pieces, 1 - joint) > kMoves) {
    return add(Severity::kFault,
               fmt::format("follows the angle of joint {}: suspect swapped columns", 2 - joint),
               other);
  }
  if (std::abs(r) < kAgree) {
    return add(Severity::kWarning, fmt::format("does not follow the angle (correlation {:.2f})", r),
               own);
  }
  if (std::abs(gain - 1) > 0.3) {
    return add(Severity::kFault,
               fmt::format("{:.4g} times the change of the angle: {}", gain, MeaningOf(gain)), own);
  }
  const std::string difference = DifferenceOf(pieces, joint);
  if (!difference.empty()) {
    return add(Severity::kNote,
               fmt::format("exactly the {} difference of the angle: no measurement of its own",
                           difference),
               own);
  }
  add(std::abs(gain - 1) > 0.1 ? Severity::kWarning : Severity::kNote,
      fmt::format("{:.3f} times the change of the angle, correlation {:.3f}", gain, r), own);
}

}  // namespace

void CheckVelocities(Pieces pieces, Findings& findings) {
  if (pieces.front().velocity.empty()) return;
  for (const int joint : {0, 1}) {
    const Reporter report{findings, Aspect::kVelocity, joint + 1};
    CheckVelocity(pieces, joint, report);
    CheckVelocityLimit(pieces, joint, report);
  }
}

}  // namespace upswing::machine
