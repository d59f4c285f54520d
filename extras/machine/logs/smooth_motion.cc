#include "extras/machine/logs/smooth_motion.h"

#include <Eigen/QR>
#include <algorithm>
#include <cmath>
#include <numbers>

#include "extras/machine/logs/angle_noise.h"
#include "extras/machine/logs/check.h"
#include "extras/machine/logs/windows.h"

namespace upswing::machine {
namespace {

/// The values at `now` (s) of the cubics, or parabolas for few rows, through the angles of the rows
/// `first` to before `last`. `span`: unit of time, s.
Joints ValueAt(const MachineLog& log, int first, int last, double now, double span) {
  constexpr int kCubicRows = 8;
  const int powers = last - first >= kCubicRows ? 4 : 3;
  Eigen::MatrixXd design(last - first, powers);
  Eigen::MatrixXd angles(last - first, 2);
  for (int k = first; k < last; ++k) {
    const double x = (log.time[k] - now) / span;
    double power = 1;
    for (int p = 0; p < powers; ++p, power *= x) design(k - first, p) = power;
    angles.row(k - first) << log.angle[k][0], log.angle[k][1];
  }
  const Eigen::MatrixXd polynomial = design.colPivHouseholderQr().solve(angles);
  return {polynomial(0, 0), polynomial(0, 1)};
}

/// The times (s) at which an angle turns round by more than `least` (rad).
std::vector<double> TurnsOf(const MachineLog& log, int joint, double least) {
  std::vector<double> turns;
  double extreme = log.angle[0][joint], time = log.time[0];
  int way = 0;  // of the motion; 0: not known yet
  for (int k = 0; k < log.rows(); ++k) {
    const double q = log.angle[k][joint];
    if (way == 0 && std::abs(q - extreme) > least) way = q > extreme ? 1 : -1;
    if (way == 0) continue;
    if (way * (q - extreme) >= 0) {
      extreme = q;
      time = log.time[k];
    } else if (way * (extreme - q) > least) {
      turns.push_back(time);
      way = -way;
      extreme = q;
      time = log.time[k];
    }
  }
  return turns;
}

}  // namespace

SmoothMotion::SmoothMotion(const MachineLog& log, double block) {
  const double cycle = UsualCycle(std::span(&log, 1));
  constexpr double kRowsOfBlock = 2.5;
  spacing_ = std::max(block, cycle);
  if (!(cycle > 0)) return;
  if (block < kRowsOfBlock * cycle) {
    for (int k = 0; k < log.rows(); ++k) {
      if (k > 0 && log.time[k] - time_.back() < cycle / 2) continue;
      time_.push_back(log.time[k]);
      angle_.push_back(log.angle[k]);
    }
  } else {
    AddKnots(log, block);
  }
  if (!empty()) FindCurvatures();
}

void SmoothMotion::AddKnots(const MachineLog& log, double block) {
  constexpr int kFewestRows = 4;
  constexpr double kCovered = 0.45;  // share of the block's span that its rows cover
  const auto row_at = [&](double time) {
    return static_cast<int>(std::ranges::lower_bound(log.time, time) - log.time.begin());
  };
  for (double now = log.time[0] + block / 2; now < log.time.back(); now += block) {
    const int first = row_at(now - block), last = row_at(now + block);
    if (last == first) {  // within a gap: go on at its end
      now = std::max(now, log.time[first] - block);
      continue;
    }
    if (last - first < kFewestRows) continue;
    if (log.time[last - 1] - log.time[first] < kCovered * 2 * block) continue;
    time_.push_back(now);
    angle_.push_back(ValueAt(log, first, last, now, block));
  }
}

/// Solves the tridiagonal equations of a natural spline (Thomas's algorithm).
void SmoothMotion::FindCurvatures() {
  const int n = static_cast<int>(time_.size());
  curvature_.assign(n, {});
  std::vector<double> upper(n, 0.0);
  for (int i = 1; i + 1 < n; ++i) {
    const double before = time_[i] - time_[i - 1], after = time_[i + 1] - time_[i];
    const double pivot = 2 * (before + after) - before * upper[i - 1];
    upper[i] = after / pivot;
    for (const int j : {0, 1}) {
      const double bend =
          (angle_[i + 1][j] - angle_[i][j]) / after - (angle_[i][j] - angle_[i - 1][j]) / before;
      curvature_[i][j] = (6 * bend - before * curvature_[i - 1][j]) / pivot;
    }
  }
  for (int i = n - 2; i > 0; --i) {
    for (const int j : {0, 1}) curvature_[i][j] -= upper[i] * curvature_[i + 1][j];
  }
}

std::optional<double> SmoothMotion::EndOfGap(double first, double last, double gap) const {
  std::optional<double> end;
  const auto begin = std::ranges::upper_bound(time_, first);
  for (auto knot = std::max(begin, time_.begin() + 1); knot != time_.end(); ++knot) {
    if (*knot - *(knot - 1) > gap) end = *knot;
    if (*knot >= last) break;
  }
  return end;
}

SmoothMotion::Point SmoothMotion::At(int joint, double time) const {
  const auto after = std::ranges::upper_bound(time_, time) - time_.begin();
  const auto i = std::clamp<std::ptrdiff_t>(after, 1, std::ssize(time_) - 1);
  const double h = time_[i] - time_[i - 1];
  const double a = (time_[i] - time) / h, b = 1 - a;
  const double y0 = angle_[i - 1][joint], y1 = angle_[i][joint];
  const double m0 = curvature_[i - 1][joint], m1 = curvature_[i][joint];
  return {a * y0 + b * y1 + ((a * a * a - a) * m0 + (b * b * b - b) * m1) * h * h / 6,
          (y1 - y0) / h + ((1 - 3 * a * a) * m0 - (1 - 3 * b * b) * m1) * h / 6};
}

double OwnTime(std::span<const MachineLog> pieces) {
  constexpr double kShare = 0.1, kMost = 0.15;  // of the range, rad: smaller turns are noise
  constexpr size_t kFewestTurns = 3;
  double least = 0;
  for (const int joint : {0, 1}) {
    const double turn = std::min(kShare * AngleRange(pieces, joint), kMost);
    if (AngleRange(pieces, joint) < kMoves || turn < 3 * StepOfNoise(AngleNoise(pieces, joint)))
      continue;
    std::vector<double> times;
    size_t turns = 0;
    for (const MachineLog& log : pieces) {
      const std::vector<double> own = TurnsOf(log, joint, turn);
      turns += own.size();
      for (size_t i = 1; i < own.size(); ++i) times.push_back(own[i] - own[i - 1]);
    }
    if (turns < kFewestTurns || times.empty()) continue;
    const double time = Median(std::move(times)) / std::numbers::pi;
    if (least == 0 || time < least) least = time;
  }
  return least;
}

}  // namespace upswing::machine
