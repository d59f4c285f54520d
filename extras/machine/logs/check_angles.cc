// Checks of the angles.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numbers>

#include "base/sample.h"
#include "extras/machine/logs/check.h"
#include "extras/machine/logs/smooth_motion.h"

namespace upswing::machine {
namespace {

/// |speed| of a joint from row k - 1 to row k, rad/s; 0 beyond the piece's ends. A row that comes
/// early after a late one counts as a usual `cycle` (s).
double SpeedTo(const MachineLog& log, int joint, int k, double cycle) {
  if (k < 1 || k >= log.rows()) return 0;
  const double seconds = std::max(log.time[k] - log.time[k - 1], cycle);
  return seconds > 0 ? std::abs(log.angle[k][joint] - log.angle[k - 1][joint]) / seconds : 0;
}

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
  const double quantum = RoughnessOf(pieces, joint);
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

/// A row whose angle the motion before and after does not explain.
struct Jump {
  const MachineLog* piece;
  int row;
  double size;  // from the row before, rad
};

/// Speed of a joint, rad/s: the median of the three steps to row `first` and the two after it.
double SpeedFrom(const MachineLog& log, int joint, int first) {
  std::vector<double> speeds;
  for (int k = first; k < first + 3; ++k) {
    if (k < 1 || k >= log.rows()) continue;
    if (log.time[k] > log.time[k - 1]) speeds.push_back(SpeedTo(log, joint, k, 0));
  }
  return QuartilesOf(std::move(speeds)).median;
}

std::vector<Jump> JumpsOf(Pieces pieces, int joint, double own_time) {
  constexpr double kLeast = 0.15;                         // rad
  constexpr double kAcceleration = 1000, kNatural = 100;  // rad/s², rad in an own time squared
  constexpr double kJitter = 1.5;                         // of a cycle's length
  constexpr int kRows = 4;                                // that repeat; CheckRepeats reports them
  constexpr double kCycles = 10;                          // of an own time, which jumps make short
  const double cycle = UsualCycle(pieces);
  own_time = std::max(own_time, kCycles * cycle);
  const double acceleration =
      own_time > 0 ? std::max(kAcceleration, kNatural / (own_time * own_time)) : kAcceleration;
  std::vector<Jump> jumps;
  for (const MachineLog& log : pieces) {
    const auto repeats = [&](int first) {
      for (int k = std::max(first, 0); k < first + kRows; ++k) {
        if (k + 1 >= log.rows() || log.angle[k + 1][joint] != log.angle[k][joint]) return false;
      }
      return first >= 0;
    };
    for (int k = 1; k < log.rows(); ++k) {
      const double seconds = log.time[k] - log.time[k - 1];
      const double size = log.angle[k][joint] - log.angle[k - 1][joint];
      // The speed before a row that follows a gap is not known.
      const bool after_gap = k >= 2 && log.time[k - 1] - log.time[k - 2] > 5 * cycle;
      if (std::abs(size) < kLeast || seconds > 5 * cycle || after_gap) continue;
      const double speed_before = SpeedFrom(log, joint, k - 3);
      const double speed_after = SpeedFrom(log, joint, k + 1);
      const double speed = std::max(speed_before, speed_after);
      const double step = std::max(seconds, cycle);
      if (std::abs(size) < kLeast + kJitter * speed * step + acceleration * step * step) continue;
      if (repeats(k) || (repeats(k - 1 - kRows) && speed > 0.5)) continue;
      jumps.push_back({&log, k, size});
    }
  }
  return jumps;
}

/// Reports wrapped angles, wrong samples, and encoders that slip.
void CheckJumps(Pieces pieces, int joint, double own_time, const Reporter& report) {
  constexpr int kShort = 3;      // rows of a wrong sample
  constexpr double kNear = 0.5;  // rad
  constexpr double kTurn = 2 * std::numbers::pi;
  const std::vector<Jump> jumps = JumpsOf(pieces, joint, own_time);
  std::vector<Jump> wraps, wrong, slips;
  for (size_t i = 0; i < jumps.size(); ++i) {
    const bool returns = i + 1 < jumps.size() && jumps[i + 1].piece == jumps[i].piece &&
                         jumps[i + 1].row - jumps[i].row <= kShort &&
                         std::abs(jumps[i + 1].size + jumps[i].size) < kNear;
    const bool is_turn = std::abs(std::abs(jumps[i].size) - kTurn) < kNear;
    if (is_turn) {
      wraps.push_back(jumps[i]);
    } else if (returns) {
      wrong.push_back(jumps[i]);
      ++i;  // the jump back
    } else {
      slips.push_back(jumps[i]);
    }
  }
  const auto add = [&](const std::vector<Jump>& found, const auto& text_of) {
    if (found.empty()) return;
    const Jump& first = found.front();
    std::string text = text_of(first);
    if (found.size() > 1) text += fmt::format("; {} times, first", found.size());
    report(Severity::kFault, text, RangeOf(*first.piece, first.row - 1, first.row),
           {{"times", static_cast<double>(found.size())}, {"jump", first.size}});
  };
  add(wraps, [](const Jump&) {
    return "jumps by a turn: suspect a wrapped angle; name the turn by the key wrap of its column";
  });
  add(wrong, [&](const Jump& jump) {
    return fmt::format("a wrong sample: {:.4g} rad after {:.4g} rad",
                       jump.piece->angle[jump.row][joint], jump.piece->angle[jump.row - 1][joint]);
  });
  add(slips, [](const Jump& jump) {
    return fmt::format("jumps by {:.3g} rad: suspect an encoder that slips or loses counts",
                       jump.size);
  });
}

/// Reports speeds that no pendulum reaches: it would turn round several times within a swing.
void CheckSpeeds(Pieces pieces, int joint, double own_time, const Reporter& report) {
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
  if (speed * own_time <= kFast) return;
  report(Severity::kFault,
         fmt::format("moves at {:.4g} rad/s: suspect degrees or counts (key unit)", speed), {},
         {{"speed", speed}});
}

}  // namespace

double RoughnessOf(Pieces pieces, int joint) {
  constexpr double kRounding = 1e-9;  // rad
  std::vector<double> bends;
  for (const MachineLog& piece : pieces) {
    for (int k = 1; k + 1 < piece.rows(); ++k) {
      const double bend = std::abs(piece.angle[k + 1][joint] - 2 * piece.angle[k][joint] +
                                   piece.angle[k - 1][joint]);
      if (bend > kRounding) bends.push_back(bend);
    }
  }
  return bends.empty() ? 0 : QuartilesOf(std::move(bends)).median;
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
    CheckRepeats(pieces, joint, own_time, report);
    CheckJumps(pieces, joint, own_time, report);
    CheckSpeeds(pieces, joint, own_time, report);
  }
}

}  // namespace upswing::machine
