// Checks of the angles.
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

}  // namespace upswing::machine
