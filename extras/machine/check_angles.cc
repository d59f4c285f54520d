// Checks of the angles and of the motion that they describe.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numbers>

#include "base/sample.h"
#include "extras/machine/check.h"

namespace upswing::machine {
namespace {

/// Step of a joint's encoder, rad: the smallest distance of two values. Nothing if other distances
/// are not multiples of it.
std::optional<double> QuantumOf(Pieces pieces, int joint) {
  std::vector<double> values;
  for (const MachineLog& piece : pieces) {
    for (const Joints& q : piece.angle) values.push_back(q[joint]);
  }
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

/// Adjacent rows of a piece with the same angle.
struct Repeat {
  const MachineLog* piece;
  int first, last;     // row indices
  double entry, exit;  // |changes of speed| at both ends, rad/s per cycle; 0 at the piece's ends
  double step;         // its first cycle, s
};

/// All repeats of at least five rows.
std::vector<Repeat> RepeatsOf(Pieces pieces, int joint) {
  constexpr int kRows = 5;
  std::vector<Repeat> repeats;
  for (const MachineLog& piece : pieces) {
    const auto difference = [&](int k) {  // |speed| from row k - 1 to row k, rad/s
      if (k < 1 || k >= piece.rows()) return 0.0;
      const double seconds = piece.time[k] - piece.time[k - 1];
      const double change = std::abs(piece.angle[k][joint] - piece.angle[k - 1][joint]);
      return seconds > 0 ? change / seconds : 0;
    };
    for (int first = 0; first < piece.rows();) {
      int last = first;
      while (last + 1 < piece.rows() && piece.angle[last + 1][joint] == piece.angle[first][joint]) {
        ++last;
      }
      if (last - first + 1 >= kRows) {
        // The change of speed may fall into two cycles.
        repeats.push_back({&piece, first, last,
                           std::max(difference(first), difference(first - 1) / 2),
                           std::max(difference(last + 1), difference(last + 2) / 2),
                           piece.time[first + 1] - piece.time[first]});
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
  return speed > kSpeed && speed > kAcceleration * repeat.step &&
         speed * repeat.step > 4.5 * quantum;
}

/// Finds repeats within motion: at the end of the range the encoder saturates, elsewhere it sticks.
void CheckRepeats(Pieces pieces, int joint, double quantum, Findings& findings) {
  double low = 0, high = 0;
  for (const MachineLog& piece : pieces) {
    for (const Joints& q : piece.angle) {
      low = std::min(low, q[joint]);
      high = std::max(high, q[joint]);
    }
  }
  const Repeat* longest[2] = {};  // saturated, stuck
  int count[2] = {};
  const std::vector<Repeat> repeats = RepeatsOf(pieces, joint);
  for (const Repeat& repeat : repeats) {
    if (!IsSudden(repeat, quantum)) continue;
    const double q = repeat.piece->angle[repeat.first][joint];
    const int stuck = std::abs(q) > std::numbers::pi && (q == low || q == high) ? 0 : 1;
    ++count[stuck];
    const Repeat*& best = longest[stuck];
    if (!best || repeat.last - repeat.first > best->last - best->first) best = &repeat;
  }
  for (const int stuck : {0, 1}) {
    if (count[stuck] == 0) continue;
    const Repeat& r = *longest[stuck];
    findings.push_back(
        {Aspect::kAngle,
         joint + 1,
         Severity::kFault,
         fmt::format("{} at {:.4g} rad while the joint moves{}",
                     stuck ? "the encoder sticks" : "saturates", r.piece->angle[r.first][joint],
                     count[stuck] > 1 ? fmt::format("; {} times, longest", count[stuck]) : ""),
         RangeOf(*r.piece, r.first, r.last),
         {{"times", count[stuck]}}});
  }
}

/// Reports speeds that no pendulum reaches.
void CheckSpeeds(Pieces pieces, int joint, Findings& findings) {
  std::vector<double> speeds;
  for (const MachineLog& piece : pieces) {
    for (int k = 1; k + 1 < piece.rows(); ++k) {
      speeds.push_back(std::abs(CentralDifference(piece, k, joint)));
    }
  }
  if (speeds.empty()) return;
  std::ranges::sort(speeds);
  constexpr double kFast = 60;  // rad/s
  const double speed = Quantile(speeds, 0.99);
  if (speed <= kFast) return;
  findings.push_back({Aspect::kAngle,
                      joint + 1,
                      Severity::kFault,
                      fmt::format("moves at {:.4g} rad/s: suspect degrees", speed),
                      {},
                      {{"speed", speed}}});
}

/// Rows without any torque.
struct Unpowered {
  const MachineLog* piece;
  int first, last;
};

/// The longest rows of a piece in which all known torques are zero.
Unpowered LongestUnpowered(const MachineLog& piece) {
  constexpr double kSensor = 0.05;  // measured torque that may be noise, N·m
  const auto torque = [](const std::vector<Joints>& values, int k) {
    return values.empty() ? 0 : std::max(std::abs(values[k][0]), std::abs(values[k][1]));
  };
  Unpowered best{&piece, 0, -1};
  int first = 0;
  for (int k = 0; k < piece.rows(); ++k) {
    if (torque(piece.commanded, k) > 0 || torque(piece.push, k) > 0 ||
        torque(piece.measured, k) > kSensor) {
      first = k + 1;
    }
    if (k - first > best.last - best.first) best = {&piece, first, k};
  }
  return best;
}

/// Largest height of a link above hanging, in its lengths, and largest speed of a joint, rad/s.
struct Extent {
  double height = 0, speed = 0;
};

Extent ExtentOf(const MachineLog& piece, int first, int last) {
  Extent extent;
  for (int k = std::max(first, 1); k <= std::min(last, piece.rows() - 2); ++k) {
    const auto& [q1, q2] = piece.angle[k];
    extent.height = std::max({extent.height, 1 - std::cos(q1), 1 - std::cos(q1 + q2)});
    for (const int joint : {0, 1}) {
      extent.speed = std::max(extent.speed, std::abs(CentralDifference(piece, k, joint)));
    }
  }
  return extent;
}

void CheckGrowth(const MachineLog& piece, Findings& findings) {
  constexpr double kLongEnough = 2;           // s
  constexpr double kHeight = 0.3;             // of a swing within 45°
  constexpr double kRest = 0.002, kGrow = 4;  // heights: amplitude 0.06 rad, and its double
  const Unpowered rows = LongestUnpowered(piece);
  if (rows.last <= rows.first) return;
  const double seconds = piece.time[rows.last] - piece.time[rows.first];
  if (seconds < kLongEnough) return;
  const int middle = (rows.first + rows.last) / 2;
  const Extent before = ExtentOf(piece, rows.first, middle);
  const Extent after = ExtentOf(piece, middle, rows.last);
  const bool grows = before.height < kHeight && after.height > kGrow * (before.height + kRest) &&
                     after.speed > 2 * before.speed + 0.3;
  if (!grows) return;
  const bool known = !piece.commanded.empty() || !piece.measured.empty();
  findings.push_back(
      {Aspect::kMotion,
       0,
       known ? Severity::kFault : Severity::kWarning,
       fmt::format("the swing grows from {:.2g} to {:.2g} rad/s {}", before.speed, after.speed,
                   known ? "without torque" : "and the log has no torque"),
       RangeOf(piece, rows.first, rows.last),
       {{"speed_before", before.speed}, {"speed_after", after.speed}}});
}

}  // namespace

void CheckAngles(Pieces pieces, Findings& findings) {
  for (const int joint : {0, 1}) {
    const std::optional<double> quantum = QuantumOf(pieces, joint);
    if (quantum) {
      findings.push_back({Aspect::kAngle,
                          joint + 1,
                          Severity::kNote,
                          fmt::format("steps of {:.3g} rad ({:.0f} per turn)", *quantum,
                                      2 * std::numbers::pi / *quantum),
                          {},
                          {{"quantum", *quantum}}});
    }
    CheckRepeats(pieces, joint, quantum.value_or(0), findings);
    CheckSpeeds(pieces, joint, findings);
  }
}

void CheckMotion(Pieces pieces, Findings& findings) {
  for (const int joint : {0, 1}) {
    constexpr double kStill = 0.01;  // rad
    if (AngleRange(pieces, joint) > kStill || AngleRange(pieces, 1 - joint) < kMoves) continue;
    findings.push_back({Aspect::kMotion, joint + 1, Severity::kWarning,
                        fmt::format("does not move although joint {} does: dry friction holds it, "
                                    "or its encoder is dead",
                                    2 - joint)});
  }
  for (const MachineLog& piece : pieces) CheckGrowth(piece, findings);
}

}  // namespace upswing::machine
