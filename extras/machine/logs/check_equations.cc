// Checks of signs, zeros, units, times and joints of angles and torques by the equations of motion
// (pendulum/equations.h). A hypothesis (hypotheses.h) is reported if it explains the motion far
// better than the columns as they are.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "base/format.h"
#include "base/sample.h"
#include "extras/machine/logs/check.h"
#include "extras/machine/logs/hypotheses.h"
#include "extras/machine/logs/weak_form.h"

namespace upswing::machine {
namespace {

constexpr int kEnough = 12;  // windows

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
  constexpr double kShare = 3e-4;  // of the larger square
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

void Report(const Hypotheses& tried, double seconds, bool in_proportion, Findings& findings) {
  const Hypothesis &log = tried.log(), &best = tried.best(), &second = tried.second();
  std::string rivals;
  // Hypotheses within this factor of the unexplained share count as equal.
  constexpr double kEqual = 2;
  if (in_proportion) {
    rivals = "; or another sign, joint or zero of angles or torques: the joints move in proportion";
  } else if (second.changes() > 0 &&
             second.cost(tried.per_change()) < best.cost(tried.per_change()) + std::log(kEqual)) {
    rivals =
        fmt::format("; or {}: this log does not tell", SentenceOf(SuspicionsOf(second, seconds)));
  }
  const std::vector<Suspicion> suspicions = SuspicionsOf(best, seconds);
  const bool is_one = suspicions.size() == 1;
  for (const Suspicion& s : suspicions) {
    Reporter{findings, s.aspect, s.joint}(
        Severity::kFault,
        fmt::format("suspect {}: with {} the equations of a pendulum leave {} of the motion "
                    "unexplained, without {} {}{}",
                    s.text, is_one ? "it" : "all suspicions", FormatPercent(best.fit.left()),
                    is_one ? "it" : "them", FormatPercent(log.fit.left()), rivals),
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

/// Twice the mean time in which the faster joint moves by a radian, s; 0 if neither moves.
double SlowTime(Pieces pieces) {
  Joints way{};
  double seconds = 0;
  for (const MachineLog& log : pieces) {
    for (int k = 1; k < log.rows(); ++k) {
      for (const int j : {0, 1}) way[j] += std::abs(log.angle[k][j] - log.angle[k - 1][j]);
    }
    seconds += log.time.back();
  }
  const double fastest = std::max(way[0], way[1]);
  return fastest > 0 ? 2 * seconds / fastest : 0;
}

/// The equations in a time (s) of the motion. Nothing if it has too few windows.
std::optional<WeakForm> FormIn(Pieces pieces, double time) {
  if (!(time > 0)) return {};
  WeakForm form(pieces, time);
  if (form.windows() < kEnough) return {};
  return form;
}

/// Bounds of the natural time, s.
struct TimeBounds {
  double least, most;
};

/// The bounds by two times of the motion (s). Joints that hold back and go on make its own time
/// short, joints that turn round make it long.
TimeBounds BoundsOf(double own, double slow) {
  constexpr double kNear = 3, kFast = 6;  // factors; motors brake links at 8 rad in a natural time
  if (!(own > 0)) own = slow;
  return {std::min(own, slow) / kNear, std::max(kNear * own, kFast * slow)};
}

/// The equations in the natural time of the machine: that of the constants that fit best, whatever
/// the zeros and signs, from a first time (s) on. If that leaves too few windows, the first time
/// has to do. Nothing if it has too few, too.
std::optional<WeakForm> FormNear(Pieces pieces, double time, const TimeBounds& bounds) {
  constexpr int kRounds = 3;
  const std::optional<WeakForm> first = FormIn(pieces, time);
  std::optional<WeakForm> form = first;
  for (int round = 0; form && round < kRounds; ++round) {
    const WeakEquations equations = form->Equations({}, {}, 0);
    const double found = NaturalTimeOf(FitAnyZeroAndSign(equations).constants);
    if (!(found > 0)) return first;
    form = FormIn(pieces, std::clamp(found, bounds.least, bounds.most));
  }
  return form ? form : first;
}

/// The way of the faster joint from a row to the next in the fastest hundredth of the rows, rad.
double LongestWay(Pieces pieces) {
  std::vector<double> ways;
  for (const MachineLog& log : pieces) {
    for (int k = 1; k < log.rows(); ++k) {
      const Joints &a = log.angle[k - 1], &b = log.angle[k];
      ways.push_back(std::max(std::abs(b[0] - a[0]), std::abs(b[1] - a[1])));
    }
  }
  std::ranges::sort(ways);
  return Quantile(ways, 0.99);
}

/// The LongestWay beyond which the motion between the rows is not known, rad.
constexpr double kFar = 1;

/// A verdict on the hypotheses about a log, with the equations that it needs.
struct Verdict {
  Pieces pieces;
  std::unique_ptr<WeakForm> form;
  std::unique_ptr<Hypotheses> tried;

  bool confirms() const {
    if (!is_plausible()) return false;
    if (!suspects_slip_or_drift()) return true;
    return improves_worse_joint() && LongestWay(pieces) <= kFar;
  }

  bool is_plausible() const {
    constexpr int kMostChanges = 3;
    constexpr double kGood = 0.2;  // share that a reported hypothesis leaves unexplained at most
    const Hypothesis& best = tried->best();
    return best.changes() > 0 && best.changes() <= kMostChanges && best.fit.left() <= kGood;
  }

  bool suspects_slip_or_drift() const {
    const Change::Kind kind = tried->best().change.kind;
    return kind == Change::kSlip || kind == Change::kDrift;
  }

  /// Whether it explains the worse joint much better, too. The angles of both joints are in both
  /// equations, so that a wrong angle shows in both.
  bool improves_worse_joint() const {
    constexpr double kTimes = 3;
    return kTimes * tried->best().fit.left() < tried->log().fit.left();
  }
};

Verdict TryHypotheses(Pieces pieces, const WeakForm& form, Driven driven) {
  Verdict verdict{pieces, std::make_unique<WeakForm>(form), nullptr};
  verdict.tried = std::make_unique<Hypotheses>(*verdict.form, pieces, driven);
  verdict.tried->TryAll();
  return verdict;
}

/// Tries hypotheses in the natural time of the machine, and, if none explains the motion, in a time
/// that turns and wrong readings do not make short. Nothing if the motion is too short.
std::optional<Verdict> Judge(Pieces pieces, Driven driven) {
  constexpr double kExplained = 0.02, kOther = 1.5;  // share, factor between the times
  const double slow = SlowTime(pieces);
  const double own = OwnTime(pieces);
  const TimeBounds bounds = BoundsOf(own, slow);
  std::optional<WeakForm> form = FormNear(pieces, own, bounds);
  if (!form) form = FormNear(pieces, slow, bounds);
  if (!form) return {};
  Verdict first = TryHypotheses(pieces, *form, driven);
  if (first.confirms() || first.tried->log().fit.left() < kExplained) return first;
  const std::optional<WeakForm> other = FormIn(pieces, slow);
  if (!other || std::abs(std::log(other->time() / form->time())) < std::log(kOther)) return first;
  Verdict second = TryHypotheses(pieces, *other, driven);
  if (second.confirms()) return second;
  return first;
}

/// Reports motors that are on in the log and off in the motion.
void ReportNoEffect(Pieces pieces, const Hypotheses& tried, Findings& findings) {
  if (!HasCommands(pieces)) return;
  if (tried.HasNoEffect()) {
    Reporter{findings, Aspect::kTorque}(
        Severity::kFault, "the commanded torques have no effect on the motion: the motors are off");
    return;
  }
  for (const int joint : {0, 1}) {
    if (!tried.HasNoEffect(joint)) continue;
    Reporter{findings, Aspect::kTorque, joint + 1}(
        Severity::kFault, "the commanded torques have no effect on the motion: this motor is off");
  }
}

/// Reports torques that cannot both be in N·m: 1 N·m of one moves the links more strongly
/// than 1 N·m of the other. A torque that has a fault already needs no second one.
void ReportTorqueRatio(const Hypotheses& tried, Findings& findings) {
  const bool is_known = std::ranges::any_of(findings, [](const Finding& finding) {
    return finding.aspect == Aspect::kTorque && finding.severity == Severity::kFault;
  });
  if (is_known) return;
  const std::optional<double> ratio = tried.TorqueRatio();
  if (!ratio) return;
  const int strong = *ratio > 1 ? 1 : 2;
  Reporter{findings, Aspect::kTorque}(
      Severity::kFault,
      fmt::format(
          "1 N·m of torque {} moves the links like {} N·m of torque {}: suspect the unit or "
          "gear of a motor, or commands between -1 and 1 (keys unit, factor)",
          strong, FormatPlain(std::max(*ratio, 1 / *ratio), 2), 3 - strong),
      {}, {{"ratio", *ratio}});
}

/// The share of a log's cycles that are lost, whose commands are unknown. 0 for measured torques.
double UnknownShare(Pieces pieces) {
  if (HasTorque(pieces.front().measured, 0) || HasTorque(pieces.front().measured, 1)) return 0;
  const double cycle = UsualCycle(pieces);
  double cycles = 0, rows = 0;
  for (const MachineLog& log : pieces) {
    cycles += log.time.back() / cycle;
    rows += log.rows() - 1;
  }
  return std::max(0.0, 1 - rows / cycles);
}

/// Reports the share of the motion that the equations leave unexplained, and what that means.
void ReportUnexplained(Pieces pieces, double left, Findings& findings) {
  // A larger share is none of a pendulum, unless the torques of lost rows are unknown.
  const double most = 0.1 + 2 * UnknownShare(pieces);
  const double way = LongestWay(pieces);
  Severity severity = Severity::kNote;
  std::string meaning;
  if (left > most && way > kFar) {
    severity = Severity::kWarning;
    meaning = fmt::format(
        ": the rows are too far apart, a joint moves by {:.2g} rad from one to the next", way);
  } else if (left > most) {
    severity = Severity::kFault;
    meaning = ", and no other reading of the columns explains it";
  }
  Reporter{findings, Aspect::kMotion}(
      severity,
      fmt::format("the equations of a pendulum leave {} of the motion unexplained{}",
                  FormatPercent(left), meaning),
      {}, {{"unexplained", left}});
}

}  // namespace

void CheckEquations(Pieces pieces, Findings& findings) {
  constexpr double kMoving = 0.3;     // rad
  constexpr double kFreeLeft = 0.03;  // share that a free pendulum leaves unexplained at most
  constexpr double kBetter = 1;       // by which torques of a motor reduce the misfit
  const Joints range{AngleRange(pieces, 0), AngleRange(pieces, 1)};
  if (range[0] < kMoving || range[1] < kMoving || !(UsualCycle(pieces) > 0)) return;
  Driven driven = DrivenJoints(pieces);
  const bool free = IsFree(pieces);
  std::optional<Verdict> verdict;
  if (free || pieces.front().commanded.empty()) {
    verdict = Judge(pieces, {false, false});
    if (!verdict) return;
    const Hypothesis& best = verdict->tried->best();
    bool moves_freely = best.fit.left() <= kFreeLeft;
    if (moves_freely && !free && best.changes() > 0) {
      // Wrong columns of a free pendulum may look like right ones of a driven one.
      const std::optional<Verdict> with_torques = Judge(pieces, driven);
      if (with_torques) {
        const Hypotheses& driven_ones = *with_torques->tried;
        moves_freely = driven_ones.log().fit.left() > kFreeLeft &&
                       driven_ones.best().misfit() > best.misfit() - kBetter;
      }
    }
    if (moves_freely) {
      driven = {false, false};
    } else if (free) {
      return ReportDriven(pieces, findings);
    }
  }
  const bool in_proportion = InProportion(pieces);
  if (!verdict || driven[0] || driven[1]) verdict = Judge(pieces, driven);
  if (!verdict) return;
  if (in_proportion && !driven[0] && !driven[1]) {
    // Other readings of the columns may explain such a motion, too. They do not change halfway.
    const bool changes = verdict->confirms() && verdict->suspects_slip_or_drift();
    if (!changes) return;
  }
  const Hypotheses& tried = *verdict->tried;
  if (verdict->confirms()) {
    double seconds = 0;
    for (const MachineLog& log : pieces) seconds += log.time.back();
    return Report(tried, seconds, in_proportion && !verdict->suspects_slip_or_drift(), findings);
  }
  ReportUnexplained(pieces, tried.log().fit.left(), findings);
  ReportNoEffect(pieces, tried, findings);
  ReportTorqueRatio(tried, findings);
}

}  // namespace upswing::machine
