#pragma once

#include <span>
#include <vector>

#include "extras/machine/logs/log.h"
#include "pendulum/plant.h"

/// Short pieces of logs, over which a model predicts the motion from a start state.
namespace upswing::machine {

/// Which windows of a log are used.
struct WindowRules {
  double seconds = 0.5;  // length
  double hop = 0.25;     // time between the starts of two windows
  // Greatest height of the tip over the pivot, as a share of the links' length. Upright, any small
  // error grows fast, and predictions are useless.
  double highest = 0.8;
  double motion = 0.05;  // least sum of both angles' standard deviations, rad
};

/// A window of a log: rows `first` to before `last`.
struct LogWindow {
  int log, first, last;
  PendulumState start;  // at the first row, from a cubic through the rows within 20 ms

  int rows() const { return last - first; }
  /// The times (rows) of its rows, s.
  std::span<const double> TimesIn(const MachineLog& own) const {
    return std::span(own.time).subspan(first, rows());
  }
};

/// The windows of these logs that keep the rules and have no gap longer than five median cycles. Of
/// a log without such a window, those with gaps of up to 0.1 s: a loop that stalls holds its
/// torques. `length1`, `length2`: lengths of the links, m.
std::vector<LogWindow> CutWindows(std::span<const MachineLog> logs, const WindowRules& rules,
                                  double length1, double length2);

/// The median of some numbers; NaN if there are none.
double Median(std::vector<double> values);
/// The median of the numbers of all lists.
double PooledMedian(std::span<const std::vector<double>> lists);

}  // namespace upswing::machine
