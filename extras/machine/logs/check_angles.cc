// Checks of the angles.
#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>

#include "base/sample.h"
#include "extras/machine/logs/angle_noise.h"
#include "extras/machine/logs/check.h"
#include "extras/machine/logs/smooth_motion.h"

namespace upswing::machine {
namespace {

/// Adjacent rows of a piece with the same angle.
struct Repeat {
  const MachineLog* piece;
  int first, last;     // row indices
  double entry, exit;  // |changes of speed| at both ends, rad/s per cycle; 0 at the piece's ends
  double cycle;        // usual one, s
  bool catches_up;     // whether the angle then jumps to where the joint is, or the piece ends
};

/// Whether row k repeats the whole reading before it: a bus that is slower than the log.
bool IsSameReading(const MachineLog& log, int k) {
  const auto repeats = [&](const std::vector<Joints>& values) {
    return values.empty() || values[k] == values[k - 1];
  };
  return log.angle[k] == log.angle[k - 1] && repeats(log.velocity) && repeats(log.measured) &&
         !(log.velocity.empty() && log.measured.empty());
}

/// All repeats of at least five readings that are long enough to mislead a model of the motion.
std::vector<Repeat> RepeatsOf(Pieces pieces, int joint, double own_time) {
  constexpr int kReadings = 5;
  constexpr double kLong = 0.1;  // of the own time of the motion
  const double cycle = UsualCycle(pieces);
  const double least = kLong * own_time;
  std::vector<Repeat> repeats;
  for (const MachineLog& piece : pieces) {
    const auto difference = [&](int k) { return SpeedTo(piece, joint, k, cycle); };
    for (int first = 0; first < piece.rows();) {
      int last = first, readings = 1;
      while (last + 1 < piece.rows() && piece.angle[last + 1][joint] == piece.angle[first][joint]) {
        ++last;
        if (!IsSameReading(piece, last)) ++readings;
      }
      if (readings >= kReadings && piece.time[last] - piece.time[first] >= least) {
        constexpr double kJump = 2.5;  // cycles of the motion that follows
        // The change of speed may fall into two cycles.
        repeats.push_back(
            {&piece, first, last, std::max(difference(first), difference(first - 1) / 2),
             std::max(difference(last + 1), difference(last + 2) / 2), cycle,
             last + 2 >= piece.rows() || difference(last + 1) > kJump * difference(last + 2)});
      }
      first = last + 1;
    }
  }
  return repeats;
}

/// Whether a joint stops or starts more suddenly than a motor can make it, and by more than a few
/// steps of the encoder.
bool IsSudden(const Repeat& repeat, double quantum) {
  constexpr double kSpeed = 0.5, kAcceleration = 300;  // rad/s, rad/s²
  const double speed = std::max(repeat.entry, repeat.exit);
  return speed > kSpeed && speed > kAcceleration * repeat.cycle &&
         speed * repeat.cycle > 4.5 * quantum;
}

/// Finds repeats within motion: at the end of the range the encoder saturates, elsewhere it sticks.
void CheckRepeats(Pieces pieces, int joint, double own_time, const Reporter& report) {
  const double quantum = StepOfNoise(AngleNoise(pieces, joint));
  const auto [low, high] = std::ranges::minmax(ValuesOf(pieces, &MachineLog::angle, joint));
  constexpr double kPi = std::numbers::pi;
  /// Repeats of one cause.
  struct Cause {
    std::string text;
    int count = 0;
    const Repeat* longest = nullptr;
  };
  Cause saturation{"saturates"};
  Cause sticking{"the encoder sticks"};
  const std::vector<Repeat> repeats = RepeatsOf(pieces, joint, own_time);
  for (const Repeat& repeat : repeats) {
    if (!IsSudden(repeat, quantum)) continue;
    const double q = repeat.piece->angle[repeat.first][joint];
    const bool at_end = (q < -kPi && q == low) || (q > kPi && q == high);
    if (!at_end && !repeat.catches_up) continue;  // dry friction holds the joint
    Cause& cause = at_end ? saturation : sticking;
    ++cause.count;
    const Repeat* best = cause.longest;
    if (!best || repeat.last - repeat.first > best->last - best->first) cause.longest = &repeat;
  }
  for (const Cause& cause : {saturation, sticking}) {
    if (cause.count == 0) continue;
    const Repeat& r = *cause.longest;
    std::string text = fmt::format("{} at {:.4g} rad while the joint moves", cause.text,
                                   r.piece->angle[r.first][joint]);
    if (cause.count > 1) text += fmt::format("; {} times, longest", cause.count);
    report(Severity::kFault, text, RangeOf(*r.piece, r.first, r.last), {{"times", cause.count}});
  }
}

/// Warns of a sensor that is slower than the log: each of its readings stands in several rows.
void CheckSlowSensor(Pieces pieces, int joint, const Reporter& report) {
  constexpr double kFast = 4;     // steps of the encoder between two readings
  constexpr double kMost = 0.8;   // share of the readings
  constexpr size_t kFewest = 20;  // readings
  const double least = kFast * StepOf(pieces, joint);
  std::vector<double> rows;  // of each reading that a clear motion ends
  for (const MachineLog& log : pieces) {
    int first = 0;  // row of the reading; 0: the piece may begin in the middle of one
    for (int k = 1; k < log.rows(); ++k) {
      const double way = std::abs(log.angle[k][joint] - log.angle[k - 1][joint]);
      if (way == 0) continue;
      if (first > 0 && way > least) rows.push_back(k - first);
      first = k;
    }
  }
  if (rows.size() < kFewest) return;
  const double usual = QuartilesOf(rows).median;
  const auto equal = static_cast<double>(std::ranges::count(rows, usual));
  if (usual < 2 || equal < kMost * static_cast<double>(rows.size())) return;
  report(
      Severity::kWarning,
      fmt::format("each reading stands in {:.0f} rows, so the sensor is slower than the log: keep "
                  "the first row of each",
                  usual),
      {}, {{"rows_per_reading", usual}});
}

}  // namespace

double SpeedTo(const MachineLog& log, int joint, int k, double cycle) {
  if (k < 1 || k >= log.rows()) return 0;
  const double seconds = std::max(log.time[k] - log.time[k - 1], cycle);
  return seconds > 0 ? std::abs(log.angle[k][joint] - log.angle[k - 1][joint]) / seconds : 0;
}

std::optional<double> QuantumOf(Pieces pieces, int joint) {
  std::vector<double> values = ValuesOf(pieces, &MachineLog::angle, joint);
  std::ranges::sort(values);
  constexpr double kRounding = 1e-9;  // rad
  std::vector<double> steps;
  for (size_t i = 1; i < values.size(); ++i) {
    if (values[i] - values[i - 1] > kRounding) steps.push_back(values[i] - values[i - 1]);
  }
  if (steps.size() < 3) return std::nullopt;
  const double quantum = *std::ranges::min_element(steps);
  // Larger steps are not tested, because rounding errors grow with them.
  double near = 0, multiples = 0;
  for (const double step : steps) {
    const double ratio = step / quantum;
    if (ratio > 20) continue;
    near += 1;
    multiples += std::abs(ratio - std::round(ratio)) < 0.02;
  }
  if (near < 6 || multiples < 0.95 * near) return {};
  return quantum;
}

double StepOf(Pieces pieces, int joint) {
  constexpr double kRounding = 1e-9;  // rad, of angles that are equal in the file
  std::vector<double> values = ValuesOf(pieces, &MachineLog::angle, joint);
  std::ranges::sort(values);
  double step = 0;
  for (size_t i = 1; i < values.size(); ++i) {
    const double distance = values[i] - values[i - 1];
    if (distance > kRounding && (step == 0 || distance < step)) step = distance;
  }
  return QuantumOf(pieces, joint).value_or(step);
}

void CheckAngles(Pieces pieces, Findings& findings) {
  const double own_time = OwnTime(pieces);
  for (const int joint : {0, 1}) {
    const Reporter report{findings, Aspect::kAngle, joint + 1};
    const std::optional<double> quantum = QuantumOf(pieces, joint);
    if (quantum) {
      report(Severity::kNote,
             fmt::format("steps of {:.3g} rad ({:.0f} per turn)", *quantum,
                         2 * std::numbers::pi / *quantum),
             {}, {{"quantum", *quantum}});
    }
    CheckSlowSensor(pieces, joint, report);
    CheckRepeats(pieces, joint, own_time, report);
  }
}

void CheckSpeeds(Pieces pieces, Findings& findings) {
  const double own_time = OwnTime(pieces);
  for (const int joint : {0, 1}) {
    std::vector<double> speeds;
    for (const MachineLog& piece : pieces) {
      for (int k = 1; k + 1 < piece.rows(); ++k) {
        speeds.push_back(std::abs(CentralDifference(piece, k, joint)));
      }
    }
    if (speeds.empty()) return;
    std::ranges::sort(speeds);
    constexpr double kFast = 25;  // rad in the time of a swing's radian
    const double speed = Quantile(speeds, 0.99);
    if (speed * own_time <= kFast) continue;
    Reporter{findings, Aspect::kAngle, joint + 1}(
        Severity::kFault,
        fmt::format("moves at {:.4g} rad/s: suspect degrees or counts (key unit)", speed), {},
        {{"speed", speed}});
  }
}

}  // namespace upswing::machine
