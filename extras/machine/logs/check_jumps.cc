// Checks of angles that jump.
#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <functional>
#include <numbers>
#include <string>
#include <vector>

#include "base/sample.h"
#include "extras/machine/logs/angle_noise.h"
#include "extras/machine/logs/check.h"
#include "extras/machine/logs/smooth_motion.h"

namespace upswing::machine {
namespace {

/// A row whose angle the motion before and after does not explain.
struct Jump {
  const MachineLog* piece;
  int row;
  double size;  // from the row before, or of a single wrong sample from its neighbours, rad
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

/// A change of an angle from row k - 1 to row k, rad, and the part of it that the speed before and
/// after it does not explain.
struct AngleStep {
  double size, excess;
};

/// The step to row k, or nothing after a gap: the speed is not known there.
std::optional<AngleStep> AngleStepTo(const MachineLog& log, int joint, int k, double cycle) {
  constexpr double kJitter = 1.5, kGap = 5;  // of a cycle's length, cycles
  const double seconds = log.time[k] - log.time[k - 1];
  const bool after_gap = k >= 2 && log.time[k - 1] - log.time[k - 2] > kGap * cycle;
  if (seconds > kGap * cycle || after_gap) return {};
  const double size = log.angle[k][joint] - log.angle[k - 1][joint];
  const double speed = std::max(SpeedFrom(log, joint, k - 3), SpeedFrom(log, joint, k + 1));
  return AngleStep{size, std::abs(size) - kJitter * speed * std::max(seconds, cycle)};
}

/// The excess that the steps of a motion have in a few rows of a hundred, rad: it is large if the
/// rows are far apart. Wrapped angles do not count.
double UsualExcess(Pieces pieces, int joint, double cycle) {
  constexpr double kShare = 0.98;
  std::vector<double> sizes;
  for (const MachineLog& log : pieces) {
    for (int k = 1; k < log.rows(); ++k) {
      const std::optional<AngleStep> step = AngleStepTo(log, joint, k, cycle);
      if (step && std::abs(step->size) < std::numbers::pi) sizes.push_back(step->excess);
    }
  }
  std::ranges::sort(sizes);
  return sizes.empty() ? 0 : std::max(0.0, Quantile(sizes, kShare));
}

std::vector<Jump> JumpsOf(Pieces pieces, int joint, double own_time) {
  constexpr double kLeast = 0.15;                         // rad
  constexpr double kAcceleration = 1000, kNatural = 100;  // rad/s², rad in an own time squared
  constexpr double kUnusual = 3;                          // times the usual excess
  constexpr int kRows = 4;                                // that repeat; CheckRepeats reports them
  constexpr double kCycles = 10;                          // of an own time, which jumps make short
  const double cycle = UsualCycle(pieces);
  own_time = std::max(own_time, kCycles * cycle);
  const double acceleration =
      own_time > 0 ? std::max(kAcceleration, kNatural / (own_time * own_time)) : kAcceleration;
  std::optional<double> usual;
  std::vector<Jump> jumps;
  for (const MachineLog& log : pieces) {
    const auto repeats = [&](int first) {
      for (int k = std::max(first, 0); k < first + kRows; ++k) {
        if (k + 1 >= log.rows() || log.angle[k + 1][joint] != log.angle[k][joint]) return false;
      }
      return first >= 0;
    };
    for (int k = 1; k < log.rows(); ++k) {
      if (std::abs(log.angle[k][joint] - log.angle[k - 1][joint]) < kLeast) continue;
      const std::optional<AngleStep> step = AngleStepTo(log, joint, k, cycle);
      const double seconds = std::max(log.time[k] - log.time[k - 1], cycle);
      if (!step || step->excess < kLeast + acceleration * seconds * seconds) continue;
      if (!usual) usual = UsualExcess(pieces, joint, cycle);
      if (step->excess < kUnusual * *usual) continue;
      if (repeats(k) || (repeats(k - 1 - kRows) && SpeedFrom(log, joint, k + 1) > 0.5)) continue;
      jumps.push_back({&log, k, step->size});
    }
  }
  return jumps;
}

/// Reports jumps of one kind in a line, which is about the first. `text_of`: what a jump says.
void ReportJumps(const std::vector<Jump>& jumps, const Reporter& report,
                 const std::function<std::string(const Jump&)>& text_of) {
  if (jumps.empty()) return;
  const Jump& first = jumps.front();
  std::string text = text_of(first);
  if (jumps.size() > 1) text += fmt::format("; {} times, first", jumps.size());
  report(Severity::kFault, text, RangeOf(*first.piece, first.row - 1, first.row),
         {{"times", static_cast<double>(jumps.size())}, {"jump", first.size}});
}

void ReportWrongSamples(const std::vector<Jump>& samples, int joint, const Reporter& report) {
  ReportJumps(samples, report, [&](const Jump& jump) {
    return fmt::format("a wrong sample: {:.4g} rad after {:.4g} rad",
                       jump.piece->angle[jump.row][joint], jump.piece->angle[jump.row - 1][joint]);
  });
}

/// Reports wrapped angles, wrong samples, and encoders that slip.
void CheckLargeJumps(Pieces pieces, int joint, double own_time, const Reporter& report) {
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
  ReportJumps(wraps, report, [](const Jump&) {
    return "jumps by a turn: suspect a wrapped angle; name the turn by the key wrap of its column";
  });
  ReportWrongSamples(wrong, joint, report);
  ReportJumps(slips, report, [](const Jump& jump) {
    return fmt::format("jumps by {:.3g} rad: suspect an encoder that slips or loses counts",
                       jump.size);
  });
}

/// The distance of an angle from the cubic through the two rows before and after it, rad.
double Deviation(const MachineLog& log, int joint, int k) {
  constexpr std::array kNear{-2, -1, 1, 2};
  double cubic = 0;
  for (const int i : kNear) {
    double weight = 1;
    for (const int j : kNear) {
      if (j == i) continue;
      const double apart = log.time[k + i] - log.time[k + j];
      weight *= apart != 0 ? (log.time[k] - log.time[k + j]) / apart : 0;
    }
    cubic += weight * log.angle[k + i][joint];
  }
  return log.angle[k][joint] - cubic;
}

/// Reports single angles that their neighbours do not explain, and that explain the deviations of
/// these: 2/3 of their own, to the other side. CheckLargeJumps reports larger ones.
void CheckSpikes(Pieces pieces, int joint, const Reporter& report) {
  constexpr double kShare = 0.99, kUnusual = 5, kSteps = 4;  // times the quantile, encoder steps
  constexpr double kNear = 0.3, kLongest = 6.5;              // share, cycles
  constexpr double kSmallest = 0.02, kLargest = 0.15;        // rad
  const double cycle = UsualCycle(pieces);
  std::vector<double> sizes;
  for (const MachineLog& log : pieces) {
    for (int k = 2; k + 2 < log.rows(); ++k) sizes.push_back(std::abs(Deviation(log, joint, k)));
  }
  if (sizes.empty()) return;
  std::ranges::sort(sizes);
  const double least = std::max({kSmallest, kUnusual * Quantile(sizes, kShare),
                                 kSteps * StepOfNoise(AngleNoise(pieces, joint))});
  std::vector<Jump> spikes;
  for (const MachineLog& log : pieces) {
    for (int k = 3; k + 3 < log.rows(); ++k) {
      const double own = Deviation(log, joint, k);
      if (std::abs(own) < least || std::abs(own) > kLargest) continue;
      // An angle that is read a cycle earlier or later is no wrong one.
      const double way = log.angle[k + 1][joint] - log.angle[k - 1][joint];
      if (std::abs(own) < std::abs(way) / 2) continue;
      if (log.time[k + 3] - log.time[k - 3] > kLongest * cycle) continue;
      const double before = Deviation(log, joint, k - 1) / own;
      const double after = Deviation(log, joint, k + 1) / own;
      if (std::abs(before + 2.0 / 3) > kNear || std::abs(after + 2.0 / 3) > kNear) continue;
      spikes.push_back({&log, k, own});
    }
  }
  ReportWrongSamples(spikes, joint, report);
}

}  // namespace

void CheckJumps(Pieces pieces, Findings& findings) {
  const double own_time = OwnTime(pieces);
  for (const int joint : {0, 1}) {
    const Reporter report{findings, Aspect::kAngle, joint + 1};
    CheckLargeJumps(pieces, joint, own_time, report);
    CheckSpikes(pieces, joint, report);
  }
}

}  // namespace upswing::machine
