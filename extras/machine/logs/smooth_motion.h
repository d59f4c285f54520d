#pragma once

#include <array>
#include <optional>
#include <span>
#include <vector>

#include "extras/machine/logs/log.h"

/// Logs as smooth motions, whatever their encoders, their rates and the digits that they print.
namespace upswing::machine {

/// The angles of a log as natural cubic splines through knots.
class SmoothMotion {
 public:
  /// A knot stands for the rows within `block` (s) of it: the value there of the cubic with the
  /// least squares. Slower rows are knots themselves.
  SmoothMotion(const MachineLog& log, double block);

  /// Whether there are knots enough for a spline.
  bool empty() const { return time_.size() < kFewest; }
  double begin() const { return time_.front(); }
  double end() const { return time_.back(); }
  /// Distance of usual knots, s.
  double spacing() const { return spacing_; }
  /// The end of the last gap between these times: two neighbouring knots further apart than `gap`.
  /// Nothing without such a gap. All in s.
  std::optional<double> EndOfGap(double first, double last, double gap) const;
  /// The knots' times, s.
  std::span<const double> knots() const { return time_; }

  struct Point {
    double angle, velocity;  // rad, rad/s
  };
  /// The angle of a joint (0 or 1) at a time (s) between begin and end, and its derivative.
  Point At(int joint, double time) const;

 private:
  static constexpr size_t kFewest = 4;

  void AddKnots(const MachineLog& log, double block);
  void FindCurvatures();

  double spacing_ = 0;
  std::vector<double> time_;       // (knots) s
  std::vector<Joints> angle_;      // (knots) rad
  std::vector<Joints> curvature_;  // (knots) second derivatives, rad/s²
};

/// A time of the motion itself, s: the median over the joint with the faster swings of the times
/// between turns, over π. For a swing of the angular frequency ω it is 1 / ω. 0 without turns.
double OwnTime(std::span<const MachineLog> pieces);

}  // namespace upswing::machine
