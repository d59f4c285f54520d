// Changes during a log: slips and drifts of encoders, offsets of torques, and a clock that changes
// its rate. A slip, a drift or an offset is a column of the equations of motion, so its size is
// fitted with the constants.
#include <algorithm>
#include <array>
#include <cmath>

#include "extras/machine/logs/hypotheses.h"

namespace upswing::machine {

Joints Hypothesis::more_turn() const {
  const Eigen::VectorXd& x = fit.constants;
  // Both angles turn gravity at link 2, angle 1 at link 1, too. Without gravity nothing is known.
  const auto turn_of = [&](int column, weak::Column gravity) {
    return x(gravity) > 0 ? x(weak::kColumns + column) / x(gravity) : 0;
  };
  const double first = turn_of(0, weak::kG1), both = turn_of(1, weak::kG2);
  return {first, both - first};
}

Hypothesis Hypotheses::WithChange(const Change& change) const {
  constexpr int kEnough = 24;  // windows for more constants
  Hypothesis next = log_;
  if (equations_.windows() < kEnough) return next;
  next.change = change;
  const WeakEquations equations = Smooth(change, equations_);
  if (equations.windows() < equations_.windows()) {
    next.excused = std::max(0.0, log_.fit.misfit() - FitSmallZeros(equations).misfit());
  }
  next.fit = FitOf(next, equations_);
  return next;
}

/// The equations with the right clock. A clock that runs fast by a factor divides all velocities by
/// it, and the rates of momenta by its square.
WeakEquations Hypotheses::WithRate(const Change& change, WeakEquations equations) {
  using namespace weak;
  for (int row = 0; row < equations.windows(); ++row) {
    if (equations.when[row] < change.place) continue;
    for (auto& A : equations.A) {
      for (const int c : {kJ1, kJ2, kB, kA, kZeroB}) A(row, c) *= change.rate * change.rate;
      for (const int c : {kD1, kD2}) A(row, c) *= change.rate;
    }
  }
  return equations;
}

/// The windows in which the motion is smooth: not those where the encoder slips, or the clock
/// changes.
WeakEquations Hypotheses::Smooth(const Change& change, const WeakEquations& equations) {
  return equations.Selected([&](int row) {
    const double place = equations.when[row];
    const bool is_sudden = change.kind == Change::kSlip || change.kind == Change::kClock;
    return !is_sudden || std::abs(place - change.place) > equations.length;
  });
}

WeakFit Hypotheses::FitOf(const Hypothesis& h, const WeakEquations& equations) const {
  if (h.change.kind == Change::kNone) return FitSmallZeros(equations);
  const WeakEquations smooth = Smooth(h.change, equations);
  if (h.change.kind == Change::kClock) return FitSmallZeros(WithRate(h.change, smooth));
  return FitSmallZeros(smooth, ColumnsOf(h.change, smooth));
}

/// Turns the angles by what the columns of a slip or drift find, which are exact for small turns.
Hypothesis Hypotheses::Turned(Hypothesis h) const {
  constexpr int kRounds = 4;
  for (int round = 0; round < kRounds && h.fit.constants.size() > weak::kColumns; ++round) {
    Hypothesis next = h;
    const Joints more = h.more_turn();
    for (const int j : {0, 1}) next.angles.turn[j] += more[j];
    next.angles.turns_at = h.change.kind == Change::kSlip ? h.change.place : -1;
    next.fit = FitOf(next, EquationsOf(next));
    if (next.misfit() >= h.misfit()) break;
    h = next;
  }
  return h;
}

std::array<Eigen::MatrixXd, 2> Hypotheses::ColumnsOf(const Change& change,
                                                     const WeakEquations& equations) const {
  std::array<Eigen::MatrixXd, 2> columns;
  const int windows = equations.windows();
  if (change.kind == Change::kOffset) {
    for (const int joint : {0, 1}) {
      columns[joint].setConstant(windows, 1, joint == change.joint ? -form_.weight() : 0);
    }
    return columns;
  }
  const AngleReading turns{.turns_at = change.kind == Change::kSlip ? change.place : -1};
  for (const int joint : {0, 1}) {
    columns[joint] = equations.A[joint].middleCols(weak::kZero1, 3);
    for (int row = 0; row < windows; ++row) {
      columns[joint].row(row) *= turns.TurnedAt(equations.when[row]);
    }
  }
  return columns;
}

}  // namespace upswing::machine
