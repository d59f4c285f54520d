// Checks of the motion that the angles and torques describe.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

#include "base/format.h"
#include "extras/machine/logs/angle_noise.h"
#include "extras/machine/logs/check.h"
#include "pendulum/plant.h"

namespace upswing::machine {
namespace {

/// Largest torque at row k, N·m; 0 if the log lacks the quantity.
double TorqueAt(const std::vector<Joints>& torque, int k) {
  return torque.empty() ? 0 : std::max(std::abs(torque[k][0]), std::abs(torque[k][1]));
}

/// Whether row k has a commanded torque or a push.
bool IsPowered(const MachineLog& piece, int k) {
  return TorqueAt(piece.commanded, k) > 0 || TorqueAt(piece.push, k) > 0;
}

/// Rows (indices) of a piece; empty if last < first.
struct Rows {
  int first = 0, last = -1;
};

/// The longest rows of a piece in which all known torques are zero.
Rows LongestUnpowered(const MachineLog& piece) {
  constexpr double kSensor = 0.05;  // measured torque that may be noise, N·m
  constexpr double kShare = 0.05;   // of the largest one, where no command tells
  double noise = kSensor;
  if (piece.commanded.empty()) {
    double largest = 0;
    for (int k = 0; k < piece.rows(); ++k) largest = std::max(largest, TorqueAt(piece.measured, k));
    noise = std::min(kSensor, kShare * largest);
  }
  Rows best;
  int first = 0;
  for (int k = 0; k < piece.rows(); ++k) {
    if (IsPowered(piece, k) || TorqueAt(piece.measured, k) > noise) first = k + 1;
    if (k - first > best.last - best.first) best = {first, k};
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

void CheckGrowth(const MachineLog& piece, const Reporter& report) {
  constexpr double kLongEnough = 2;           // s
  constexpr double kHeight = 0.3;             // of a swing within 45°
  constexpr double kRest = 0.002, kGrow = 4;  // heights: amplitude 0.06 rad, and its double
  const Rows rows = LongestUnpowered(piece);
  if (rows.last <= rows.first) return;
  const double seconds = piece.time[rows.last] - piece.time[rows.first];
  if (seconds < kLongEnough) return;
  const int middle = (rows.first + rows.last) / 2;
  const Extent before = ExtentOf(piece, rows.first, middle);
  const Extent after = ExtentOf(piece, middle, rows.last);
  const bool grows = before.height < kHeight && after.height > kGrow * (before.height + kRest) &&
                     after.speed > 2 * before.speed + 0.3;
  if (!grows) return;
  Severity severity = Severity::kFault;
  const char* torque = "without torque";
  if (piece.commanded.empty() && piece.measured.empty()) {
    severity = Severity::kWarning;
    torque = "and the log has no torque";
  }
  report(severity,
         fmt::format("the swing grows from {:.2g} to {:.2g} rad/s {}", before.speed, after.speed,
                     torque),
         RangeOf(piece, rows.first, rows.last),
         {{"speed_before", before.speed}, {"speed_after", after.speed}});
}

/// Rows of a piece at rest without torque, after which a torque moves it or the piece ends. (A hand
/// may hold a pendulum that is released to swing.) Empty if they are shorter than 0.3 s.
Rows RestOf(const MachineLog& piece) {
  constexpr double kLong = 0.3, kStill = 0.01;  // s, rad
  for (int first = 0; first < piece.rows();) {
    int last = first;
    const auto rests = [&](int k) {
      return !IsPowered(piece, k) && std::abs(piece.angle[k][0] - piece.angle[first][0]) < kStill &&
             std::abs(piece.angle[k][1] - piece.angle[first][1]) < kStill;
    };
    while (last + 1 < piece.rows() && rests(last + 1)) ++last;
    const bool counts = last + 1 == piece.rows() || IsPowered(piece, last + 1);
    if (counts && rests(first) && piece.time[last] - piece.time[first] > kLong) {
      return {first, last};
    }
    first = last + 1;
  }
  return {};
}

/// Reports a rest where gravity would move a link: an angle with another zero or meaning. Returns
/// whether there is one.
bool CheckRest(const MachineLog& piece, const Reporter& report) {
  constexpr double kHeld = 0.35, kUpright = 0.1;  // rad; dry friction holds a link within
  const Rows rest = RestOf(piece);
  if (rest.last < rest.first) return false;
  const auto [q1, q2] = piece.angle[rest.first];
  const double links[] = {q1, q1 + q2};
  const auto hangs = [](double link) { return std::abs(Wrapped(link)) < kHeld; };
  if (std::ranges::all_of(links, hangs)) return false;
  const bool upright = std::ranges::all_of(links, [&](double link) {
    return hangs(link) || std::abs(Wrapped(link - std::numbers::pi)) < kUpright;
  });
  const bool known = !piece.commanded.empty();
  const Severity severity = known && !upright ? Severity::kFault : Severity::kWarning;
  const char* torque = known ? "without torque" : "and the log has no torque";
  const char* place = upright ? "with a link upright" : "where gravity moves a link";
  report(severity,
         fmt::format("rests at {:.3g} and {:.3g} rad {}, {}: suspect another zero (key hanging) or "
                     "an angle against the vertical (key absolute)",
                     q1, q2, torque, place),
         RangeOf(piece, rest.first, rest.last));
  return true;
}

/// Largest change of a joint's torques, N·m, apart from noise: the range of their means over 0.3 s.
/// 0 if it is not clear of the noise.
double TorqueChange(const MachineLog& piece, const std::vector<Joints>& torque, int joint) {
  constexpr double kMean = 0.3, kClear = 5;  // s, standard deviations of the noise
  if (torque.empty()) return 0;
  double least = std::numeric_limits<double>::infinity(), most = -least, sum = 0, squares = 0;
  int rows = 0;
  double begin = piece.time[0];
  for (int k = 0; k < piece.rows(); ++k) {
    sum += torque[k][joint];
    ++rows;
    if (k > 0) squares += std::pow(torque[k][joint] - torque[k - 1][joint], 2);
    if (piece.time[k] - begin < kMean) continue;
    least = std::min(least, sum / rows);
    most = std::max(most, sum / rows);
    begin = piece.time[k];
    sum = 0;
    rows = 0;
  }
  const double noise = std::sqrt(squares / 2 / piece.rows());
  return most - least > kClear * noise ? most - least : 0;
}

/// Whether a joint stays within a few steps of its encoder, or within the noise of its sensor.
bool IsStill(Pieces pieces, int joint) {
  constexpr double kSteps = 4, kRounding = 1e-9;  // of the encoder, rad
  const double range = AngleRange(pieces, joint);
  const double step = std::max(StepOf(pieces, joint), StepOfNoise(AngleNoise(pieces, joint)));
  return range < kMoves && range <= kSteps * step + kRounding;
}

/// Reports a log in which nothing moves: it says nothing about the machine.
void CheckNoMotion(Pieces pieces, Findings& findings) {
  if (!IsStill(pieces, 0) || !IsStill(pieces, 1)) return;
  double change = 0;
  for (const MachineLog& piece : pieces) {
    for (const int joint : {0, 1}) {
      change = std::max({change, TorqueChange(piece, piece.commanded, joint),
                         TorqueChange(piece, piece.measured, joint)});
    }
  }
  const double range = std::max(AngleRange(pieces, 0), AngleRange(pieces, 1));
  const std::string angles = range > 0 ? fmt::format(
                                             "both angles stay within {} rad, a few steps "
                                             "of the encoders",
                                             FormatPlain(range, 2))
                                       : "no angle ever changes";
  const Reporter report{findings, Aspect::kMotion};
  if (!(change > 0)) {
    report(Severity::kWarning,
           fmt::format("nothing moves: {}; the log says nothing about the machine", angles));
    return;
  }
  report(Severity::kFault,
         fmt::format("nothing moves: {} although the torques change by {} N·m: both encoders are "
                     "dead, the motors are off, or dry friction holds both joints",
                     angles, FormatPlain(change, 2)),
         {}, {{"change", change}});
}

}  // namespace

void CheckMotion(Pieces pieces, Findings& findings) {
  CheckStuck(pieces, findings);
  for (const int joint : {0, 1}) {
    constexpr double kStill = 0.01;  // rad
    if (AngleRange(pieces, joint) > kStill || AngleRange(pieces, 1 - joint) < kMoves) continue;
    if (IsStuck(findings, joint)) continue;
    Reporter{findings, Aspect::kMotion, joint + 1}(
        Severity::kWarning, fmt::format("does not move although joint {} does: dry friction holds "
                                        "it, or its encoder is dead",
                                        2 - joint));
  }
  CheckNoMotion(pieces, findings);
  const Reporter report{findings, Aspect::kMotion};
  for (const MachineLog& piece : pieces) CheckGrowth(piece, report);
  for (const MachineLog& piece : pieces) {
    if (CheckRest(piece, report)) break;  // one finding is enough
  }
  // The equations of motion do not hold for an encoder that sticks.
  if (!IsStuck(findings, 0) && !IsStuck(findings, 1)) CheckEquations(pieces, findings);
}

}  // namespace upswing::machine
