// Checks for rows that are lost, or written twice, while the clock counts on. Over a lost row both
// angles move as far as in two cycles, and over a row that is there twice they do not move.
#include <Eigen/Core>
#include <Eigen/QR>
#include <algorithm>
#include <array>
#include <cmath>
#include <vector>

#include "base/format.h"
#include "base/sample.h"
#include "base/text.h"
#include "extras/machine/logs/check.h"

namespace upswing::machine {
namespace {

/// Rows before, and after, a cycle that is compared with a smooth motion.
constexpr int kSide = 3;
using SixAngles = Eigen::Matrix<double, 2 * kSide, 1>;
using SixBySix = Eigen::Matrix<double, 2 * kSide, 2 * kSide>;

/// Whether a joint moves in six rows, but keeps its angle in a cycle that is not the middle one:
/// the rows come faster than the readings of its sensor, or than the steps of its encoder. Such
/// cycles differ without a loss.
bool RepeatsReadings(const MachineLog& log, int joint, int first) {
  constexpr double kSame = 1e-12;  // rad
  bool holds = false, moves = false;
  for (int i = 0; i + 1 < 2 * kSide; ++i) {
    const double way = log.angle[first + i + 1][joint] - log.angle[first + i][joint];
    const bool is_same = std::abs(way) < kSame;
    moves = moves || !is_same;
    holds = holds || (is_same && i != kSide - 1);
  }
  return holds && moves;
}

/// Whether the clock shows no loss in six rows, and no angle is held.
bool IsComparable(const MachineLog& log, int first, double cycle) {
  const double seconds = log.time[first + 2 * kSide - 1] - log.time[first];
  if (seconds > (2 * kSide - 0.5) * cycle) return false;
  return !RepeatsReadings(log, 0, first) && !RepeatsReadings(log, 1, first);
}

/// Six adjacent rows of a piece.
struct SixRows {
  const MachineLog* piece;
  int first;

  /// The angles of a joint over the first one, rad.
  SixAngles Angles(int joint) const {
    SixAngles angles;
    for (int i = 0; i < 2 * kSide; ++i) angles(i) = piece->angle[first + i][joint];
    angles.array() -= angles(0);
    return angles;
  }
};

/// All comparable stretches of six rows.
std::vector<SixRows> ComparableRows(Pieces pieces, double cycle) {
  std::vector<SixRows> stretches;
  for (const MachineLog& log : pieces) {
    for (int first = 0; first + 2 * kSide <= log.rows(); ++first) {
      if (IsComparable(log, first, cycle)) stretches.push_back({&log, first});
    }
  }
  return stretches;
}

/// The projection onto what no cubic in time explains of six angles, if the cycle in their middle
/// is as long as `cycles` of the others.
SixBySix NoCubic(double cycles) {
  constexpr int kPowers = 4;
  Eigen::Matrix<double, 2 * kSide, kPowers> design;
  for (int i = 0; i < 2 * kSide; ++i) {
    const double time = i < kSide ? i - (kSide - 1) : i - kSide + cycles;
    for (int p = 0; p < kPowers; ++p) design(i, p) = std::pow(time / kSide, p);
  }
  const Eigen::HouseholderQR<decltype(design)> qr(design);
  SixBySix Q = qr.householderQ();
  Q.leftCols<kPowers>().setZero();
  return Q * Q.transpose();
}

/// Counts of cycles in which the motion is clear of the noise. A jump of the torque looks like a
/// lost row as often as like a duplicate.
struct ClearCycles {
  double normal = 0;      // with the motion of one cycle
  double lost = 0;        // with the motion of two: a row is lost
  double duplicated = 0;  // without motion: a row is there twice

  /// The share of `rows` in all, if they are more than the others can be.
  double ShareOf(double rows, double others) const {
    constexpr double kFewest = 5, kSigmas = 3, kMuch = 5e-3;  // rows, deviations, share
    const double least = std::max({kFewest, kSigmas * std::sqrt(rows + others), kMuch * normal});
    return rows - others >= least ? rows / (rows + normal) : 0;
  }
};

/// Compares each cycle with the motion of no, one and two cycles, by both angles.
ClearCycles CountClearCycles(Pieces pieces, double cycle) {
  constexpr double kClear = 6, kBetter = 8;   // times the noise, factor of the squares
  constexpr double kFreedom = 2 * kSide - 4;  // of six angles and a cubic
  constexpr double kQuartile = 0.575;  // lower, of the chi-squared distribution with 2 degrees
  const std::array<SixBySix, 3> no_cubic{NoCubic(0), NoCubic(1), NoCubic(2)};
  const std::vector<SixRows> stretches = ComparableRows(pieces, cycle);
  if (stretches.empty()) return {};
  // Of both joints, in variances of their noise.
  std::vector<std::array<double, 3>> squares(stretches.size());
  for (const int joint : {0, 1}) {
    std::vector<std::array<double, 3>> own;  // rad²
    std::vector<double> usual;
    for (const SixRows& stretch : stretches) {
      const SixAngles angles = stretch.Angles(joint);
      std::array<double, 3>& left = own.emplace_back();
      for (int n : {0, 1, 2}) left[n] = angles.dot(no_cubic[n] * angles);
      usual.push_back(left[1]);
    }
    // Many stretches may have a loss, so the quartile tells of the noise. It is 0 if most angles
    // are the same.
    const double step = StepOf(pieces, joint);
    const double variance = std::max(QuartilesOf(usual).low / kQuartile, step * step / 12);
    if (!(variance > 0)) continue;  // the joint never moves
    for (size_t k = 0; k < own.size(); ++k) {
      for (int n : {0, 1, 2}) squares[k][n] += own[k][n] / variance;
    }
  }
  ClearCycles counts;
  const double clear = 2 * kFreedom * kClear;
  for (const auto& [none, single, twice] : squares) {
    counts.normal += twice > clear && twice > kBetter * single;
    if (single < clear) continue;
    counts.lost += single > kBetter * twice && twice < none;
    counts.duplicated += single > kBetter * none && none < twice;
  }
  return counts;
}

}  // namespace

void CheckLostRows(Pieces pieces, double cycle, const Reporter& report) {
  const auto add = [&](double share, const char* what, const char* name) {
    report(Severity::kFault, Concat("about ", FormatPercent(share), " of the rows are ", what), {},
           {{name, share}});
  };
  const ClearCycles counts = CountClearCycles(pieces, cycle);
  const double duplicated = counts.ShareOf(counts.duplicated, counts.lost);
  if (duplicated > 0) {
    add(duplicated, "duplicates, but the clock counts on: write each row once", "double_share");
    return;
  }
  const double lost = counts.ShareOf(counts.lost, counts.duplicated);
  if (lost == 0) return;
  add(lost, "lost, but the clock counts on: write the time of each row", "lost_share");
}

}  // namespace upswing::machine
