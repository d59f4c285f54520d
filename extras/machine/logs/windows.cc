#include "extras/machine/logs/windows.h"

#include <Eigen/QR>
#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

#include "base/sample.h"
#include "extras/machine/logs/check.h"

namespace upswing::machine {
namespace {

constexpr double kCubicSpan = 0.02;    // s, to both sides of a start
constexpr int kCubicRows = 6;          // fewest rows for the cubic
constexpr double kMargin = 0.05;       // s, between a window and an end of its log
constexpr double kGapCycles = 5;       // usual cycles of the longest gap in a window
constexpr double kLongestStall = 0.1;  // longest gap in a window of a log without better ones, s

/// The state at a row: value and slope of the cubics through the angles around it.
PendulumState StateAt(const MachineLog& log, int row) {
  const double now = log.time[row];
  int first = row, last = row + 1;
  while (first > 0 && now - log.time[first - 1] <= kCubicSpan) --first;
  while (last < log.rows() && log.time[last] - now <= kCubicSpan) ++last;
  if (last - first < kCubicRows) {
    first = std::max(0, row - 2);
    last = std::min(log.rows(), row + 3);
  }
  Eigen::MatrixXd powers(last - first, 4);
  Eigen::MatrixXd angles(last - first, 2);
  for (int k = first; k < last; ++k) {
    const double x = (log.time[k] - now) / kCubicSpan;
    powers.row(k - first) << 1, x, x * x, x * x * x;
    angles.row(k - first) << log.angle[k][0], log.angle[k][1];
  }
  const Eigen::MatrixXd cubic = powers.colPivHouseholderQr().solve(angles);
  return {cubic(0, 0), cubic(0, 1), cubic(1, 0) / kCubicSpan, cubic(1, 1) / kCubicSpan};
}

/// Cuts a log into windows.
struct LogCutter {
  const MachineLog& log;
  int index;  // of the log
  const WindowRules& rules;
  double length1, length2;  // m

  /// The windows without a gap longer than this (s).
  std::vector<LogWindow> Cut(double longest_gap) const {
    std::vector<LogWindow> windows;
    const double end = log.time.back() - kMargin;
    for (double start = log.time.front() + kMargin; start + rules.seconds < end;
         start += rules.hop) {
      const int first = RowAt(start);
      // A start within a gap moves to the gap's end, with as many hops as that takes.
      const double ahead = log.time[first] - start;
      if (ahead > rules.hop) {
        start += (std::ceil(ahead / rules.hop) - 1) * rules.hop;
        continue;
      }
      const int last = RowAt(log.time[first] + rules.seconds);
      if (KeepsRules(first, last, longest_gap)) {
        windows.push_back({index, first, last, StateAt(log, first)});
      }
    }
    return windows;
  }

  /// The first row at a time (s) or later.
  int RowAt(double time) const {
    return static_cast<int>(std::ranges::lower_bound(log.time, time) - log.time.begin());
  }

  bool KeepsRules(int first, int last, double longest_gap) const {
    Joints sum{}, squares{};
    for (int k = first; k < last; ++k) {
      const Joints& q = log.angle[k];
      const double height = -length1 * std::cos(q[0]) - length2 * std::cos(q[0] + q[1]);
      if (height > rules.highest * (length1 + length2)) return false;
      if (k > first && log.time[k] - log.time[k - 1] > longest_gap) return false;
      for (int j = 0; j < 2; ++j) {
        sum[j] += q[j] - log.angle[first][j];
        squares[j] += (q[j] - log.angle[first][j]) * (q[j] - log.angle[first][j]);
      }
    }
    const double n = last - first;
    double motion = 0;
    for (int j = 0; j < 2; ++j) {
      motion += std::sqrt(std::max(0.0, squares[j] / n - sum[j] / n * sum[j] / n));
    }
    return motion >= rules.motion;
  }
};

}  // namespace

double Median(std::vector<double> values) {
  if (values.empty()) return std::numeric_limits<double>::quiet_NaN();
  return QuartilesOf(std::move(values)).median;
}

double PooledMedian(std::span<const std::vector<double>> lists) {
  std::vector<double> all;
  for (const auto& list : lists) all.insert(all.end(), list.begin(), list.end());
  return Median(std::move(all));
}

std::vector<LogWindow> CutWindows(std::span<const MachineLog> logs, const WindowRules& rules,
                                  double length1, double length2) {
  std::vector<LogWindow> windows;
  for (int index = 0; index < static_cast<int>(logs.size()); ++index) {
    const MachineLog& log = logs[index];
    if (log.rows() < kCubicRows) continue;
    const LogCutter cutter{log, index, rules, length1, length2};
    std::vector<LogWindow> own = cutter.Cut(kGapCycles * UsualCycle(std::span(&log, 1)));
    // A loop that stalls again and again holds its torques meanwhile.
    if (own.empty()) own = cutter.Cut(kLongestStall);
    windows.insert(windows.end(), own.begin(), own.end());
  }
  return windows;
}

}  // namespace upswing::machine
