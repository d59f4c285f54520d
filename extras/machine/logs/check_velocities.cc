// Checks of the velocities against the angles.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numbers>

#include "base/format.h"
#include "base/text.h"
#include "extras/machine/logs/angle_noise.h"
#include "extras/machine/logs/check.h"

namespace upswing::machine {
namespace {

/// Rows in which a moving joint usually passes some steps of its encoder, at least 1.
int SpanOf(Pieces pieces, int joint) {
  constexpr double kSteps = 5;
  constexpr int kLongest = 50;
  const double step = StepOfNoise(AngleNoise(pieces, joint));
  const double cycle = UsualCycle(pieces);
  double squares = 0, rows = 0;
  for (const double v : ValuesOf(pieces, &MachineLog::velocity, joint)) {
    squares += v * v;
    rows += 1;
  }
  const double way = std::sqrt(squares / std::max(1.0, rows)) * cycle;  // in a usual cycle
  if (!(way > 0)) return 1;
  return static_cast<int>(std::clamp(std::ceil(kSteps * step / (2 * way)), 1.0, 1.0 * kLongest));
}

/// Velocities of `joint` against differences of the angle of `other` from `span` rows before to
/// `span` rows after. The velocities are means over these rows.
Pairs VelocityPairs(Pieces pieces, int joint, int other, int span) {
  Pairs pairs;
  for (const MachineLog& piece : pieces) {
    for (int k = span; k + span < piece.rows(); ++k) {
      const int first = k - span, last = k + span;
      const double seconds = piece.time[last] - piece.time[first];
      if (!(seconds > 0)) continue;
      double way = 0;  // the integral of the velocity
      for (int i = first; i < last; ++i) {
        const double mean = (piece.velocity[i][joint] + piece.velocity[i + 1][joint]) / 2;
        way += mean * (piece.time[i + 1] - piece.time[i]);
      }
      pairs.Add((piece.angle[last][other] - piece.angle[first][other]) / seconds, way / seconds);
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
  const int span = SpanOf(pieces, joint);
  const Pairs own = VelocityPairs(pieces, joint, joint, span);
  const double r = own.correlation(), gain = own.gain();
  if (AngleRange(pieces, joint) < kMoves) {
    return add(Severity::kNote, "not compared: the joint hardly moves", own);
  }
  constexpr double kAgree = 0.8, kClear = 0.9, kBetter = 0.02;  // correlations
  const Pairs other = VelocityPairs(pieces, joint, 1 - joint, span);
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
               fmt::format("{:.3g} times the change of the angle: {}", gain, MeaningOf(gain)), own);
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

/// Reports velocities of both joints that are the same multiple of the change of the angles: then
/// the clock is more likely wrong than both sensors.
void CheckClockByVelocities(Pieces pieces, const Reporter& report) {
  constexpr double kOff = 0.025, kEqual = 0.01, kExact = 0.999;  // gains, correlation
  Joints gain{};
  for (const int joint : {0, 1}) {
    const Pairs own = VelocityPairs(pieces, joint, joint, SpanOf(pieces, joint));
    gain[joint] = own.gain();
    if (AngleRange(pieces, joint) < kMoves || own.correlation() < kExact) return;
  }
  const double mean = (gain[0] + gain[1]) / 2;
  if (std::abs(gain[0] - gain[1]) > kEqual || std::abs(mean - 1) < kOff) return;
  if (std::abs(mean - 1) > 0.3) return;  // CheckVelocity reports it
  report(Severity::kFault,
         fmt::format("both velocities are {:.3f} times the change of their angles: suspect a clock "
                     "that is {} {} (key factor), or another unit of both velocities",
                     mean, FormatPercent(std::abs(1 / mean - 1)), mean < 1 ? "fast" : "slow"),
         {}, {{"gain", mean}});
}

}  // namespace

void CheckVelocities(Pieces pieces, Findings& findings) {
  if (pieces.front().velocity.empty()) return;
  for (const int joint : {0, 1}) {
    const Reporter report{findings, Aspect::kVelocity, joint + 1};
    CheckVelocity(pieces, joint, report);
    CheckVelocityLimit(pieces, joint, report);
  }
  CheckClockByVelocities(pieces, {findings, Aspect::kClock});
}

}  // namespace upswing::machine
