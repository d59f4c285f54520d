#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <functional>
#include <numbers>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "extras/machine/logs/check.h"
#include "extras/machine/logs/weak_form.h"

/// Hypotheses about faults of a log: other ways to read its columns. The constants of the
/// motion are fitted to each (weak_form.h), and compared by the motion that they leave unexplained.
namespace upswing::machine {

inline constexpr double kFullTurn = 2 * std::numbers::pi, kOneDegree = kFullTurn / 360;
/// A nearer zero of an angle is an offset that identification finds, rad.
inline constexpr double kZero = 0.3;

/// Changes of an encoder, a torque or the clock during a log. A change of an encoder or a torque
/// adds a column to the equations. A change of the clock multiplies columns.
struct Change {
  enum Kind { kNone, kSlip, kDrift, kOffset, kClock } kind = kNone;
  double place = 0;  // of a slip, or of a change of the clock, in the log, from 0 to 1
  int joint = 0;     // of an offset of the torque, 0 or 1
  double rate = 1;   // of the clock after the place, over that before
};

/// A way to read a log, and how well it explains the motion.
struct Hypothesis {
  AngleReading angles;
  TorqueReading torques;
  double delay = 0;      // of the torques, s
  bool is_late = false;  // whether the delay is none of a motor
  Change change;
  WeakFit fit;
  double excused = 0;  // misfit that the windows which it leaves out explain without it

  /// Misfit of the equations that are not used up by constants.
  double misfit() const { return fit.misfit() - 2 * std::log(fit.freedom) + excused; }
  /// By which the columns of a slip or drift turn the angles further than `angles`, rad.
  Joints more_turn() const;
  /// Number of things that are wrong with the log.
  int changes() const;
  double cost(double per_change) const { return misfit() + per_change * changes(); }
};

/// Fits constants whose zeros are small. Larger ones are another hypothesis.
WeakFit FitSmallZeros(const WeakEquations& equations,
                      const std::array<Eigen::MatrixXd, 2>& free = {});

/// Whether both name the same fault, at most with another number.
bool IsSameKind(const Hypothesis& a, const Hypothesis& b);

/// Whether a column of torques acts on a joint (0 or 1).
using Driven = std::array<bool, 2>;

/// Tries hypotheses about a log.
class Hypotheses {
 public:
  /// `form` is used while this object lives.
  Hypotheses(const WeakForm& form, Pieces pieces, Driven driven);

  void TryAll();

  /// The log as it is.
  const Hypothesis& log() const { return log_; }
  /// The hypothesis that the log confirms; log() if it confirms none.
  const Hypothesis& best() const { return best_; }
  /// The best one with other changes than best().
  const Hypothesis& second() const { return second_; }
  /// By which a change has to reduce the misfit to count as much as best() does.
  double per_change() const { return per_change_; }
  /// Whether the motion, which is explained well, is the same without the torques of a joint, or of
  /// all joints.
  bool HasNoEffect(int joint) const;
  bool HasNoEffect() const;
  /// The effect of 1 N·m of torque 1 over that of torque 2, by the motion. Nothing unless both are
  /// known, and one effect for both torques explains the motion far worse.
  std::optional<double> TorqueRatio() const;

 private:
  bool IsDriven() const { return driven_[0] || driven_[1]; }

  // hypotheses_scan.cc: numbers that a scan finds.
  void TryScales();
  void TryScale(int joint, bool absolute);
  void TryTimes();
  void TryLateTorques(int way);
  void TryTorques();
  void TryLimits(Joints TorqueReading::*limit, bool only_small);
  void TryEncoders();
  void TryDrift();
  void TryClock();
  void TryPlaces(double step, const std::function<Hypothesis(double)>& with);
  /// The hypothesis with a number near `value`, improved by steps that halve down to `least`.
  /// `with`: the fitted hypothesis with a number.
  static Hypothesis Refined(Hypothesis found, double value, double step, double least,
                            const std::function<Hypothesis(double)>& with);

  // hypotheses_readings.cc: conventions.
  void TryReadings();
  void TryReading(const AngleReading& reading);
  void TryZerosAndSigns(const Hypothesis& h);
  void ImproveZeros(Hypothesis& h) const;
  void TrySigns(const Hypothesis& h);
  WeakFit FitAnySign(const Hypothesis& h) const;
  std::vector<WeakFit> FitsOfSigns(const Hypothesis& h) const;
  std::vector<Joints> Signs(bool swapped) const;

  // hypotheses_changes.cc: slips, drifts and offsets.
  Hypothesis WithChange(const Change& change) const;
  Hypothesis Turned(Hypothesis h) const;
  static WeakEquations WithRate(const Change& change, WeakEquations equations);
  static WeakEquations Smooth(const Change& change, const WeakEquations& equations);
  /// The fit of a hypothesis to its equations.
  WeakFit FitOf(const Hypothesis& h, const WeakEquations& equations) const;
  /// The columns of a slip, drift or offset.
  std::array<Eigen::MatrixXd, 2> ColumnsOf(const Change& change,
                                           const WeakEquations& equations) const;

  // hypotheses.cc.
  std::vector<double> UsualDelays() const;
  void ImproveDelay(Hypothesis& h) const;
  void ImproveDelays();
  bool IsSmall(const Hypothesis& h) const;
  void Offer(const Hypothesis& h);
  void Choose();
  Joints NoiseShares(const WeakFit& fit) const;
  bool ExplainsToNoise(const WeakFit& fit) const;
  bool ShowsAtItsMotor(const Hypothesis& h) const;

  WeakEquations EquationsOf(const WeakForm& form, const Hypothesis& h) const;
  WeakEquations EquationsOf(const Hypothesis& h) const { return EquationsOf(form_, h); }
  void SetTorques(const TorqueReading& torques, double delay, WeakEquations& equations) const;
  void DropIdleTorques(const TorqueReading& torques, WeakEquations& equations) const;
  Hypothesis WithAngles(const AngleReading& angles) const;
  Hypothesis WithTorques(const TorqueReading& torques, double delay) const;

  const WeakForm& form_;
  WeakForm thin_;  // some of its windows, for scans
  Driven driven_;
  Joints range_, noise_;  // of the angles, rad
  Joints largest_;        // torques of the log, N·m
  double cycle_;
  bool absolute_;  // whether the file's angles of joint 2 are against the vertical
  double per_change_;
  Hypothesis log_;
  WeakEquations equations_;          // of it
  std::vector<Hypothesis> offered_;  // the best of each kind
  double least_cost_;                // of them and the log
  Hypothesis best_, second_;
};

/// What a hypothesis says about an aspect of a joint (1 or 2; 0: both).
struct Suspicion {
  Aspect aspect;
  int joint;
  std::string text;
};

/// All that a hypothesis changes. `seconds`: length of the log.
std::vector<Suspicion> SuspicionsOf(const Hypothesis& h, double seconds);

/// The same in one sentence.
std::string SentenceOf(const std::vector<Suspicion>& suspicions);

}  // namespace upswing::machine
