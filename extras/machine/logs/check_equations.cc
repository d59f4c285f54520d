// Checks of signs, zeros, units, times and joints of angles and torques by the equations of motion
// (pendulum/equations.h). Each thing that may be wrong with a log is a hypothesis: another way to
// read the columns. The constants of the motion are fitted to each (weak_form.h). A hypothesis is
// reported if it explains the motion far better than the columns as they are.
#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <optional>
#include <string>
#include <vector>

#include "extras/machine/logs/check.h"
#include "extras/machine/logs/weak_form.h"

namespace upswing::machine {
namespace {

constexpr double kFullTurn = 2 * std::numbers::pi, kOneDegree = kFullTurn / 360;
constexpr double kChange = 2.5;  // by which a change must reduce the misfit
constexpr int kEnough = 12;      // windows
constexpr double kZero = 0.3;    // rad; a nearer zero is an offset that identification finds

/// Fits constants whose zeros are small. Larger ones are another hypothesis.
WeakFit FitSmallZeros(const WeakEquations& equations,
                      const std::array<Eigen::MatrixXd, 2>& free = {}) {
  using namespace weak;
  WeakFit fit = Fit(equations, free);
  const auto [zero1, zero12, zero2] = fit.zeros();
  if (std::max({std::abs(zero1), std::abs(zero12), std::abs(zero12 - zero1)}) <= kZero) return fit;
  WeakEquations without = equations;
  for (const int joint : {0, 1}) without.A[joint].middleCols(kZero1, 3).setZero();
  return Fit(without, free);
}

/// Changes of an encoder during a log: more columns of the equations.
struct Change {
  enum Kind { kNone, kSlip, kDrift, kOffset } kind = kNone;
  double place = 0;  // of a slip in the log, from 0 to 1
  int joint = 0;     // of an offset of the torque, 0 or 1
};

/// A way to read a log, and how well it explains the motion.
struct Hypothesis {
  AngleReading angles;
  TorqueReading torques;
  double delay = 0;      // of the torques, s
  bool is_late = false;  // whether the delay is none of a motor
  Change change;
  WeakFit fit;

  int changes() const {
    const auto has_scale = [](double scale) { return std::abs(scale) != 1; };
    const bool has_unit = has_scale(angles.scale[0]) || has_scale(angles.scale[1]);
    return (angles.scale[0] < 0) + (angles.scale[1] < 0) + has_unit + (angles.link1 != 0) +
           angles.swapped + (angles.swapped != torques.swapped) + (torques.sign[0] < 0) +
           (torques.sign[1] < 0) + (std::abs(angles.zero[0]) > kZero) +
           (std::abs(angles.zero[1]) > kZero) + (angles.late != 0) + is_late +
           (torques.largest > 0) + (torques.dead_band > 0) + (torques.flips_at >= 0) +
           (change.kind != Change::kNone);
  }
  double cost(double per_change) const { return fit.misfit() + per_change * changes(); }
};

/// The largest torque of a log, N·m.
double LargestTorque(Pieces pieces) {
  double largest = 0;
  for (const auto quantity : {&MachineLog::commanded, &MachineLog::measured}) {
    for (const int joint : {0, 1}) {
      for (const double u : ValuesOf(pieces, quantity, joint))
        largest = std::max(largest, std::abs(u));
    }
  }
  return largest;
}

/// Whether a column of torques acts on a joint (0 or 1).
using Driven = std::array<bool, 2>;

/// Tries hypotheses about a log.
class Hypotheses {
 public:
  Hypotheses(const WeakForm& form, Driven driven, double cycle)
      : form_(form),
        driven_(driven),
        cycle_(cycle),
        per_change_(kChange * (1 + 8.0 / form.windows())) {
    FindDelay();
    best_ = second_ = log_;
  }

  const Hypothesis& log() const { return log_; }
  const Hypothesis& best() const { return best_; }
  /// The best one with other changes than the best.
  const Hypothesis& second() const { return second_; }
  double per_change() const { return per_change_; }

  void TryAll(Pieces pieces) {
    TryReadings({AngleRange(pieces, 0), AngleRange(pieces, 1)});
    TryScales();
    TryTimes();
    TryTorques(LargestTorque(pieces));
    TryEncoders();
  }

  bool IsDriven() const { return driven_[0] || driven_[1]; }

  /// Whether the motion, which is explained well, is the same without the torques.
  bool HasNoEffect() const {
    constexpr double kExplained = 0.02, kMore = 0.3;  // share, of the misfit
    if (!IsDriven()) return false;
    if (log_.fit.left() > kExplained) return false;
    WeakEquations without = equations_;
    without.A[0].col(weak::kTorque1).setZero();
    without.A[1].col(weak::kTorque2).setZero();
    return Fit(without).misfit() < log_.fit.misfit() + kMore;
  }

 private:
  /// `range`: of both angles, rad.
  void TryReadings(const Joints& range) {
    for (const AngleReading& reading : Readings(range)) TryReading(reading);
  }

  void TryScales() {
    for (const double scale : {1.0 / 2, 1.0 / 3, 1.0 / 4, 1.0 / 7, 2.0, 3.0, 4.0, 7.0}) {
      for (const Joints& both : {Joints{scale, 1}, {1, scale}, {scale, scale}}) {
        TryAngles({.scale = both});
      }
    }
    for (const int joint : {0, 1}) {
      Hypothesis found = log_;
      for (double step = 0.1; step > 0.002; step /= 2) {
        for (const double factor : {1 - step, 1 + step}) {
          Hypothesis next = found;
          next.angles.scale[joint] *= factor;
          const double scale = next.angles.scale[joint];
          if (scale < 0.7 || scale > 1.4) continue;
          Refit(next);
          if (next.fit.misfit() < found.fit.misfit()) found = next;
        }
      }
      Offer(found);
    }
  }

  void TryTimes() {
    for (const double late : {-0.1, -0.05, 0.05, 0.1}) TryAngles({.late = late * form_.time()});
    if (!IsDriven()) return;
    const std::vector<double> normal = Normal();
    for (const double late : {-0.6, -0.45, -0.3, -0.2, 0.2, 0.3, 0.45, 0.6}) {
      Hypothesis next = log_;
      next.delay = late * form_.time();
      if (next.delay > normal.front() && next.delay < normal.back()) continue;
      next.is_late = true;
      RefitTorques(next);
      Offer(next);
    }
  }

  /// `largest`: torque of the log, N·m.
  void TryTorques(double largest) {
    if (!IsDriven()) return;
    for (double TorqueReading::*limit : {&TorqueReading::largest, &TorqueReading::dead_band}) {
      Hypothesis found = log_;
      const auto try_share = [&](double share) {
        if (!(share > 0) || share >= 1) return;
        Hypothesis next = log_;
        next.torques.*limit = share * largest;
        RefitTorques(next);
        if (next.fit.misfit() < found.fit.misfit()) found = next;
      };
      for (double share = 0.1; share < 0.95; share += 0.1) try_share(share);
      for (double step = 0.05; step > 0.005; step /= 2) {
        const double share = found.torques.*limit / largest;
        for (const double next : {share - step, share + step}) try_share(next);
      }
      Offer(found);
    }
    for (double place = 0.1; place < 0.95; place += 0.1) TryTorque({.flips_at = place});
    for (const int joint : {0, 1}) {
      if (driven_[joint]) TryChange({Change::kOffset, 0, joint});
    }
  }

  void TryEncoders() {
    for (double place = 0.1; place < 0.92; place += 0.05) TryChange({Change::kSlip, place});
    TryChange({Change::kDrift});
  }

  /// All ways to read angles with these ranges that are another convention, without their mirror
  /// images.
  static std::vector<AngleReading> Readings(const Joints& range) {
    constexpr double kLeast = 0.3, kMost = 100;  // rad
    std::vector<AngleReading> readings;
    for (const Joints& unit : {Joints{1, 1},
                               {kFullTurn, kFullTurn},
                               {kOneDegree, kOneDegree},
                               {kOneDegree, 1},
                               {1, kOneDegree}}) {
      if (std::ranges::any_of(std::array{0, 1}, [&](int j) {
            const double moves = unit[j] * range[j];
            return unit[j] != 1 && (moves < kLeast || moves > kMost);
          })) {
        continue;
      }
      for (const Joints& sign : {Joints{1, 1}, {1, -1}}) {
        for (const double link1 : {0, 1, -1}) {
          for (const bool swapped : {false, true}) {
            readings.push_back({.scale = {sign[0] * unit[0], sign[1] * unit[1]},
                                .link1 = link1,
                                .swapped = swapped});
          }
        }
      }
    }
    return readings;
  }

  /// Delays that motors have, s.
  std::vector<double> Normal() const {
    const double first = -1.5 * cycle_ - 0.04 * form_.time();
    const double last = 2 * cycle_ + 0.1 * form_.time();
    std::vector<double> delays;
    constexpr int kSteps = 8;
    for (int i = 0; i <= kSteps; ++i) delays.push_back(first + i * (last - first) / kSteps);
    return delays;
  }

  /// Fits the log as it is, with the delay of its torques that explains the motion best.
  void FindDelay() {
    equations_ = EquationsOf(log_);
    log_.fit = FitSmallZeros(equations_);
    if (!IsDriven()) return;
    WeakEquations equations = equations_;
    const auto try_delay = [&](double delay) {
      SetTorques(log_.torques, delay, equations);
      const WeakFit fit = FitSmallZeros(equations);
      if (fit.misfit() >= log_.fit.misfit()) return;
      log_.delay = delay;
      log_.fit = fit;
    };
    const std::vector<double> normal = Normal();
    for (const double delay : normal) try_delay(delay);
    for (double step = (normal[1] - normal[0]) / 2; step > 0.002 * form_.time(); step /= 2) {
      const double middle = log_.delay;
      for (const double delay : {middle - step, middle + step}) {
        if (delay >= normal.front() && delay <= normal.back()) try_delay(delay);
      }
    }
    SetTorques(log_.torques, log_.delay, equations_);
  }

  WeakEquations EquationsOf(const Hypothesis& h) const {
    WeakEquations equations = form_.Equations(h.angles, h.torques, h.delay);
    DropIdleTorques(h.torques, equations);
    return equations;
  }
  void SetTorques(const TorqueReading& torques, double delay, WeakEquations& equations) const {
    form_.SetTorques(torques, delay, equations);
    DropIdleTorques(torques, equations);
  }
  /// Idle motors report torques that have nothing to do with the motion.
  void DropIdleTorques(const TorqueReading& torques, WeakEquations& equations) const {
    if (!driven_[torques.swapped ? 1 : 0]) equations.A[0].col(weak::kTorque1).setZero();
    if (!driven_[torques.swapped ? 0 : 1]) equations.A[1].col(weak::kTorque2).setZero();
  }

  /// Fits the constants again, with the hypothesis's delay.
  void Refit(Hypothesis& h) const { h.fit = FitSmallZeros(EquationsOf(h)); }

  /// The same for a hypothesis that leaves the angles as they are.
  void RefitTorques(Hypothesis& h) const {
    WeakEquations equations = equations_;
    SetTorques(h.torques, h.delay, equations);
    h.fit = FitSmallZeros(equations);
  }

  /// The columns of a change that there is.
  std::array<Eigen::MatrixXd, 2> ColumnsOf(const Change& change,
                                           const WeakEquations& equations) const {
    std::array<Eigen::MatrixXd, 2> columns;
    const int windows = equations.windows();
    if (change.kind == Change::kOffset) {
      for (const int joint : {0, 1}) {
        columns[joint].setConstant(windows, 1, joint == change.joint ? -form_.weight() : 0);
      }
      return columns;
    }
    for (const int joint : {0, 1}) {
      columns[joint] = equations.A[joint].middleCols(weak::kZero1, 3);
      for (int row = 0; row < windows; ++row) {
        const double place = equations.when[row];
        const bool after = place > change.place;
        columns[joint].row(row) *= change.kind == Change::kSlip ? (after ? 1 : 0) : place - 0.5;
      }
    }
    return columns;
  }

  void Offer(const Hypothesis& h) {
    if (h.cost(per_change_) < best_.cost(per_change_)) {
      if (!IsSameKind(h, best_)) second_ = best_;
      best_ = h;
    } else if (h.cost(per_change_) < second_.cost(per_change_) && !IsSameKind(h, best_)) {
      second_ = h;
    }
  }

  /// Whether both name the same fault, at most with another number.
  static bool IsSameKind(const Hypothesis& a, const Hypothesis& b) {
    const auto scaled = [](const Hypothesis& h, int j) { return std::abs(h.angles.scale[j]) != 1; };
    return scaled(a, 0) == scaled(b, 0) && scaled(a, 1) == scaled(b, 1) &&
           a.angles.scale[0] * b.angles.scale[0] > 0 && a.angles.scale[1] * b.angles.scale[1] > 0 &&
           a.angles.link1 == b.angles.link1 && a.angles.swapped == b.angles.swapped &&
           a.torques.swapped == b.torques.swapped && a.torques.sign == b.torques.sign &&
           (a.angles.late != 0) == (b.angles.late != 0) && a.is_late == b.is_late &&
           (a.torques.largest > 0) == (b.torques.largest > 0) &&
           (a.torques.dead_band > 0) == (b.torques.dead_band > 0) &&
           (a.torques.flips_at >= 0) == (b.torques.flips_at >= 0) && a.change.kind == b.change.kind;
  }

  void TryAngles(const AngleReading& angles) {
    Hypothesis next = log_;
    next.angles = angles;
    Refit(next);
    Offer(next);
  }
  void TryTorque(const TorqueReading& torques) {
    Hypothesis next = log_;
    next.torques = torques;
    RefitTorques(next);
    Offer(next);
  }
  void TryChange(const Change& change) {
    Hypothesis next = log_;
    next.change = change;
    WeakEquations equations = equations_;
    if (change.kind == Change::kSlip) {  // no window has a smooth motion where the encoder slips
      for (int row = 0; row < equations.windows(); ++row) {
        if (std::abs(equations.when[row] - change.place) > equations.length) continue;
        for (const int joint : {0, 1}) equations.A[joint].row(row).setZero();
      }
    }
    next.fit = FitSmallZeros(equations, ColumnsOf(change, equations));
    Offer(next);
  }

  /// Tries a reading and its mirror image, both with all joints of the torques.
  void TryReading(const AngleReading& reading) {
    Hypothesis h = log_;
    h.angles = reading;
    WeakEquations equations = EquationsOf(h);
    for (const bool swapped : {false, true}) {
      if (swapped && !IsDriven()) continue;
      h.torques.swapped = swapped;
      if (swapped) SetTorques(h.torques, h.delay, equations);
      // No zeros and signs explain more than this, of the mirror image as well.
      h.fit = FitAnyZeroAndSign(equations);
      for (const double mirror : {1, -1}) {
        Hypothesis next = h;
        for (double& scale : next.angles.scale) scale *= mirror;
        if (next.cost(per_change_) < best_.cost(per_change_)) TryZerosAndSigns(next);
      }
    }
  }

  /// Tries a reading with its zeros and with others, and with all signs of the torques.
  void TryZerosAndSigns(const Hypothesis& h) {
    TrySigns(h);
    const auto [zero1, zero12, zero2] = FitAnyZeroAndSign(EquationsOf(h)).zeros();
    for (const Joints& zero :
         {Joints{zero1, zero12 - zero1}, {zero12 - zero2, zero2}, {zero1, zero2}}) {
      Hypothesis turned = h;
      turned.angles.zero = zero;
      ImproveZeros(turned);
      TrySigns(turned);
    }
  }

  /// Adds the small zeros that the fit finds to those of the reading.
  void ImproveZeros(Hypothesis& h) const {
    for (int round = 0; round < 3; ++round) {
      const WeakFit fit = FitAnySign(h);
      if (!(fit.constants(weak::kG1) > 0) || !(fit.constants(weak::kG2) > 0)) return;
      const auto [zero1, zero12, zero2] = fit.zeros();
      h.angles.zero[0] = std::remainder(h.angles.zero[0] + zero1, kFullTurn);
      h.angles.zero[1] = std::remainder(h.angles.zero[1] + zero12 - zero1, kFullTurn);
    }
  }

  /// The best fit with any signs of the torques.
  WeakFit FitAnySign(const Hypothesis& h) const {
    std::optional<WeakFit> best;
    for (const WeakFit& fit : FitsOfSigns(h)) {
      if (!best || fit.misfit() < best->misfit()) best = fit;
    }
    return *best;
  }

  void TrySigns(const Hypothesis& h) {
    const std::vector<Joints> signs = Signs(h.torques.swapped);
    const std::vector<WeakFit> fits = FitsOfSigns(h);
    for (size_t i = 0; i < signs.size(); ++i) {
      Hypothesis next = h;
      next.torques.sign = signs[i];
      next.fit = fits[i];
      Offer(next);
    }
  }

  /// The fits of a hypothesis with each of Signs.
  std::vector<WeakFit> FitsOfSigns(const Hypothesis& h) const {
    const WeakEquations equations = EquationsOf(h);
    std::vector<WeakFit> fits;
    for (const Joints& sign : Signs(h.torques.swapped)) {
      WeakEquations turned = equations;
      turned.A[0].col(weak::kTorque1) *= sign[0];
      turned.A[1].col(weak::kTorque2) *= sign[1];
      fits.push_back(FitSmallZeros(turned));
    }
    return fits;
  }

  /// The signs of torques that act.
  std::vector<Joints> Signs(bool swapped) const {
    const bool first = driven_[swapped ? 1 : 0], second = driven_[swapped ? 0 : 1];
    std::vector<Joints> signs;
    for (const Joints& sign : {Joints{1, 1}, {-1, 1}, {1, -1}, {-1, -1}}) {
      if ((sign[0] > 0 || first) && (sign[1] > 0 || second)) signs.push_back(sign);
    }
    return signs;
  }

  const WeakForm& form_;
  Driven driven_;
  double cycle_, per_change_;
  Hypothesis log_;           // as it is
  WeakEquations equations_;  // of it
  Hypothesis best_, second_;
};

/// Whether the joints move nearly in proportion, which several explanations allow.
bool InProportion(Pieces pieces) {
  constexpr double kProportion = 0.95;
  Pairs pairs;
  for (const MachineLog& log : pieces) {
    for (const Joints& q : log.angle) pairs.Add(q[0], q[1]);
  }
  return std::abs(pairs.correlation()) > kProportion;
}

/// The joints with commands or pushes. Without either, those with measured torques: an idle motor
/// may report some, too, but less than the other.
Driven DrivenJoints(Pieces pieces) {
  Driven driven{HasCommand(pieces, 0), HasCommand(pieces, 1)};
  for (const MachineLog& log : pieces) {
    for (const int j : {0, 1}) driven[j] = driven[j] || HasTorque(log.push, j);
  }
  if (driven[0] || driven[1]) return driven;
  Joints squares{};
  for (const MachineLog& log : pieces) {
    for (const Joints& torque : log.measured) {
      for (const int j : {0, 1}) squares[j] += torque[j] * torque[j];
    }
  }
  constexpr double kShare = 0.01;  // of the larger square
  const double least = kShare * std::max(squares[0], squares[1]);
  return {squares[0] > least, squares[1] > least};
}

/// Whether no motor drives the machine, if the log is right: it has no torques, or all commands are
/// 0. (Idle motors report torques, too.)
bool IsFree(Pieces pieces) {
  const bool pushed = std::ranges::any_of(pieces, [](const MachineLog& log) {
    return HasTorque(log.push, 0) || HasTorque(log.push, 1);
  });
  if (pushed) return false;
  if (!pieces.front().commanded.empty()) return !HasCommands(pieces);
  return std::ranges::none_of(pieces, [](const MachineLog& log) {
    return HasTorque(log.measured, 0) || HasTorque(log.measured, 1);
  });
}

/// A suspicion about an aspect of a joint (1 or 2; 0: both).
struct Suspicion {
  Aspect aspect;
  int joint;
  std::string text;
};

/// The factor of an angle, in words.
std::string ScaleText(double scale) {
  if (std::abs(scale - kFullTurn) < 1e-9) return "turns (key unit)";
  if (std::abs(scale - kOneDegree) < 1e-9) return "degrees (key unit)";
  return fmt::format(
      "an angle of {:.3g} times the true one: the counts of the encoder, a belt or a gear "
      "(factor = {:.4g})",
      1 / scale, scale);
}

/// A change of an encoder or a torque during the log. `seconds`: length of the log.
Suspicion SuspicionOfChange(const Hypothesis& h, double seconds) {
  const Eigen::VectorXd& x = h.fit.constants;
  const auto extra = [&](int i) { return x(weak::kColumns + i); };
  if (h.change.kind == Change::kOffset) {
    const int joint = h.change.joint;
    const double effect = x(joint == 0 ? weak::kTorque1 : weak::kTorque2);
    return {Aspect::kTorque, joint + 1,
            fmt::format("an offset of {:.2g} N·m", effect > 0 ? -extra(0) / effect : 0)};
  }
  // Both angles turn gravity at link 2, angle 1 at link 1, too.
  const double first = extra(0) / x(weak::kG1), both = extra(1) / x(weak::kG2);
  const bool is_first = std::abs(first) > std::abs(both - first);
  const double turn = -(is_first ? first : both - first);
  const std::string text =
      h.change.kind == Change::kSlip
          ? fmt::format("an encoder that slips by {:.2g} rad near {:.3g} s", turn,
                        h.change.place * seconds)
          : fmt::format("an encoder that drifts by {:.2g} rad/s", turn / seconds);
  return {Aspect::kAngle, is_first ? 1 : 2, text};
}

/// All that a hypothesis changes. `seconds`: length of the log.
std::vector<Suspicion> SuspicionsOf(const Hypothesis& h, double seconds) {
  std::vector<Suspicion> all;
  const auto add = [&](Aspect aspect, int joint, const std::string& text) {
    all.push_back({aspect, joint, text});
  };
  const AngleReading& r = h.angles;
  const TorqueReading& t = h.torques;
  if (r.swapped && t.swapped) add(Aspect::kMotion, 0, "swapped columns of both joints");
  if (r.swapped && !t.swapped) add(Aspect::kAngle, 0, "swapped angles");
  if (!r.swapped && t.swapped) add(Aspect::kTorque, 0, "swapped torques");
  if (r.link1 != 0) {
    add(Aspect::kAngle, 2,
        r.link1 > 0 ? "an angle against the vertical (key absolute)"
                    : "an angle against link 1 (without key absolute)");
  }
  if (r.late != 0) {
    const double late = -r.late;
    add(Aspect::kAngle, 2,
        fmt::format("angles that are {:.2g} ms {} than those of joint 1", 1e3 * std::abs(late),
                    late < 0 ? "later" : "earlier"));
  }
  for (const int j : {0, 1}) {
    if (std::abs(r.scale[j]) != 1) add(Aspect::kAngle, j + 1, ScaleText(std::abs(r.scale[j])));
    if (r.scale[j] < 0) add(Aspect::kAngle, j + 1, "the opposite sign (factor = -1)");
    if (t.sign[j] < 0) add(Aspect::kTorque, j + 1, "the opposite sign (factor = -1)");
    if (std::abs(r.zero[j]) <= kZero) continue;
    // The reading of a link that hangs, by the column's own sign.
    const double hangs =
        -std::copysign(1.0, r.scale[j]) * (j == 1 ? r.zero[1] + r.link1 * r.zero[0] : r.zero[j]);
    const double zero = std::remainder(hangs, kFullTurn);
    add(Aspect::kAngle, j + 1,
        fmt::format("another zero, {:.2f} rad ({:.0f} deg) when its link {} (add it to the key "
                    "hanging, in the column's unit)",
                    zero, zero / kOneDegree,
                    j == 0 || r.link1 > 0 ? "hangs" : "is in line with link 1"));
  }
  if (h.is_late) {
    add(Aspect::kTorque, 0,
        fmt::format("torques that are {:.2g} ms {} than they act", 1e3 * std::abs(h.delay),
                    h.delay > 0 ? "earlier" : "later"));
  }
  if (t.largest > 0) {
    add(Aspect::kTorque, 0, fmt::format("motors that saturate near {:.2g} N·m", t.largest));
  }
  if (t.dead_band > 0) {
    add(Aspect::kTorque, 0, fmt::format("a dead band of about {:.2g} N·m", t.dead_band));
  }
  if (t.flips_at >= 0) {
    add(Aspect::kTorque, 0, fmt::format("a sign that turns near {:.3g} s", t.flips_at * seconds));
  }
  if (h.change.kind != Change::kNone) all.push_back(SuspicionOfChange(h, seconds));
  return all;
}

std::string TextOf(const std::vector<Suspicion>& suspicions) {
  std::string text;
  for (const Suspicion& s : suspicions) {
    if (!text.empty()) text += " and ";
    text += s.joint > 0 ? fmt::format("{} {}: {}", NameOf(s.aspect), s.joint, s.text) : s.text;
  }
  return text;
}

void Report(const Hypotheses& tried, double seconds, bool in_proportion, Findings& findings) {
  const Hypothesis &log = tried.log(), &best = tried.best(), &second = tried.second();
  std::string rivals;
  // Hypotheses within this factor of the unexplained share count as equal.
  constexpr double kEqual = 2;
  if (in_proportion) {
    rivals = "; or another sign, joint or zero of angles or torques: the joints move in proportion";
  } else if (second.changes() > 0 &&
             second.cost(tried.per_change()) < best.cost(tried.per_change()) + std::log(kEqual)) {
    rivals = fmt::format("; or {}: this log does not tell", TextOf(SuspicionsOf(second, seconds)));
  }
  for (const Suspicion& s : SuspicionsOf(best, seconds)) {
    Reporter{findings, s.aspect, s.joint}(
        Severity::kFault,
        fmt::format("suspect {}: with it the equations of a pendulum leave {:.2g}% of the motion "
                    "unexplained, without it {:.2g}%{}",
                    s.text, 100 * best.fit.left(), 100 * log.fit.left(), rivals),
        {}, {{"unexplained", log.fit.left()}, {"unexplained_after", best.fit.left()}});
  }
}

/// Reports a driven machine whose log has no torques.
void ReportDriven(Pieces pieces, Findings& findings) {
  const bool zero = !pieces.front().commanded.empty() || !pieces.front().measured.empty();
  Reporter{findings, Aspect::kTorque}(
      Severity::kFault,
      fmt::format("{}, but no free pendulum moves like this: suspect {} columns "
                  "(keys commanded1, commanded2) or a hand",
                  zero ? "all torques of the motors are 0" : "the log has no torque",
                  zero ? "wrong" : "missing"));
}

/// The equations in the natural time of the machine: that of the constants that fit best, whatever
/// the zeros and signs. If that leaves too few windows, the own time of the motion has to do.
/// Nothing if the motion has none, or too few windows.
std::optional<WeakForm> FormOf(Pieces pieces) {
  const double own = OwnTime(pieces);
  if (!(own > 0)) return {};
  constexpr int kRounds = 3;
  constexpr double kNear = 3;  // largest factor between the own time and the natural time
  WeakForm first(pieces, own);
  if (first.windows() < kEnough) return {};
  WeakForm form = first;
  for (int round = 0; round < kRounds; ++round) {
    const WeakEquations equations = form.Equations({}, {}, 0);
    const double found = NaturalTimeOf(FitAnyZeroAndSign(equations).constants);
    if (!(found > 0)) return first;
    form = WeakForm(pieces, std::clamp(found, own / kNear, kNear * own));
    if (form.windows() < kEnough) return first;
  }
  return form;
}

}  // namespace

void CheckEquations(Pieces pieces, Findings& findings) {
  constexpr double kMoving = 0.3;  // rad
  constexpr int kMostChanges = 3;
  constexpr double kFreeLeft = 0.03;  // share that a free pendulum leaves unexplained at most
  constexpr double kGood = 0.2;       // share that a reported hypothesis leaves unexplained at most
  constexpr double kUnexplained = 0.1;  // share that is none of a pendulum
  const Joints range{AngleRange(pieces, 0), AngleRange(pieces, 1)};
  if (range[0] < kMoving || range[1] < kMoving) return;
  const double cycle = UsualCycle(pieces);
  if (!(cycle > 0)) return;
  Driven driven = DrivenJoints(pieces);
  const bool free = IsFree(pieces);
  const std::optional<WeakForm> found = FormOf(pieces);
  if (!found) return;
  const WeakForm& form = *found;
  if (free || pieces.front().commanded.empty()) {
    Hypotheses undriven(form, {false, false}, cycle);
    undriven.TryAll(pieces);
    if (undriven.best().fit.left() <= kFreeLeft) {
      driven = {false, false};
    } else if (free) {
      return ReportDriven(pieces, findings);
    }
  }
  const bool in_proportion = InProportion(pieces);
  if (in_proportion && !driven[0] && !driven[1]) return;
  Hypotheses tried(form, driven, cycle);
  tried.TryAll(pieces);
  const Hypothesis& best = tried.best();
  const Reporter report{findings, Aspect::kMotion};
  if (best.changes() == 0 || best.changes() > kMostChanges || best.fit.left() > kGood) {
    const double left = tried.log().fit.left();
    report(left > kUnexplained ? Severity::kFault : Severity::kNote,
           fmt::format(
               "the equations of a pendulum leave {:.2g}% of the motion unexplained{}", 100 * left,
               left > kUnexplained ? ", and no other reading of the columns explains it" : ""),
           {}, {{"unexplained", left}});
    if (HasCommands(pieces) && tried.HasNoEffect()) {
      Reporter{findings, Aspect::kTorque}(
          Severity::kFault,
          "the commanded torques have no effect on the motion: the motors are off");
    }
    return;
  }
  double seconds = 0;
  for (const MachineLog& log : pieces) seconds += log.time.back();
  Report(tried, seconds, in_proportion, findings);
}

}  // namespace upswing::machine
