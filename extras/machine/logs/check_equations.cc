// Checks of signs, zeros, units and joints by the equations of motion (pendulum/equations.h). Their
// parameters are unknown: least squares find them. If the motion is that of a pendulum only after a
// change of the columns, the check names the change.
#include <fmt/format.h>

#include <Eigen/Dense>
#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <optional>
#include <utility>

#include "extras/machine/logs/check.h"
#include "extras/machine/logs/check_terms.h"

namespace upswing::machine {
namespace {

std::vector<Window> WindowsOf(Pieces pieces, double cycle) {
  constexpr double kLength = 0.08;  // s
  constexpr int kMost = 800;        // windows; more would only take longer
  const int span = SpanOf(cycle);
  const int length = std::max(3, static_cast<int>(std::lround(kLength / cycle)));
  double rows = 0;
  for (const MachineLog& log : pieces) rows += log.rows();
  const int hop = std::max(length, static_cast<int>(rows / kMost));
  std::vector<Window> windows;
  for (const MachineLog& log : pieces) {
    for (int k = span; k + length + span < log.rows(); k += hop) {
      Window window = WindowAt(log, k, k + length, span, cycle);
      if (!window.empty()) windows.push_back(std::move(window));
    }
  }
  return windows;
}

using Gram = Eigen::Matrix<double, kTerms, kTerms>;

/// Products of all terms of the equation of each joint, summed over the windows.
std::array<Gram, 2> GramsOf(const std::vector<Window>& windows, const Reading& reading) {
  std::array<Gram, 2> grams{Gram::Zero(), Gram::Zero()};
  for (const Window& window : windows) {
    const auto terms = TermsOf(window, reading);
    for (const int row : {0, 1}) grams[row] += terms[row] * terms[row].transpose();
  }
  return grams;
}

/// The share of `target`, a term with a sign, that the other terms leave unexplained when `zero` is
/// added to the angles. Least squares find the coefficients of these terms, which are not negative.
/// If the inertia is the target, the coefficients of both torques may have any sign.
double Unexplained(const Gram& gram, int row, const Joints& zero, Term target, double sign) {
  constexpr int kCoefficients = 8, kSigned = 6;
  using Square = Eigen::Matrix<double, kCoefficients + 1, kCoefficients + 1>;
  const double z2 = zero[1], z12 = zero[0] + zero[1];
  Eigen::Matrix<double, kTerms, kCoefficients + 1> pick;
  pick.setZero();
  pick(kOther, 0) = 1;
  pick(kCoupling, 1) = std::cos(z2), pick(kTurnedCoupling, 1) = std::sin(z2);
  pick(kLink2, 2) = std::cos(z12), pick(kTurnedLink2, 2) = std::sin(z12);
  pick(kLink1, 3) = std::cos(zero[0]), pick(kTurnedLink1, 3) = std::sin(zero[0]);
  pick(kDamping, 4) = pick(kFriction, 5) = 1;
  if (target == kInertia) {
    pick(kTorque1, 6) = pick(kTorque2, 7) = 1;
  } else {
    pick(kInertia, 6) = 1;
  }
  pick(target, kCoefficients) = sign;
  const Square A = pick.transpose() * gram * pick;
  const double all = A(kCoefficients, kCoefficients);
  if (!(all > 0)) return 1;
  Eigen::Matrix<double, kCoefficients + 1, 1> x;
  x.setZero();
  x[kCoefficients] = target == kInertia ? 1 : -1;
  for (int sweep = 0; sweep < 100; ++sweep) {  // coordinate descent
    double moved = 0;
    for (int i = 0; i < kCoefficients; ++i) {
      if (!(A(i, i) > 0)) continue;
      const double before = x[i];
      x[i] -= A.row(i).dot(x) / A(i, i);
      if (i < kSigned || target != kInertia) x[i] = std::max(0.0, x[i]);
      // The mass matrix is positive: 2 b < J1 + J2.
      if (i == 1 && row == 0 && target == kInertia) x[i] = std::min(0.5, x[i]);
      moved = std::max(moved, A(i, i) * (x[i] - before) * (x[i] - before));
    }
    if (moved < 1e-8 * all) break;
  }
  return x.dot(A * x) / all;
}

constexpr double kChange = 1.8;  // by which a change must reduce the misfit
constexpr double kZero = 0.3;    // rad; a nearer zero is an offset that identification finds

/// An explanation of the motion: how to read the angles, and the motors' joints and signs.
struct Explanation {
  Reading reading;
  double noise = 0;  // unexplained share of a right explanation
  Joints zero{};
  Joints unexplained{1, 1};  // share, of each joint's inertia
  bool torques_swapped = false;
  Joints torque_sign{1, 1};
  double torque_misfit = 0;

  /// The logarithm of an unexplained share; below the noise all are equal.
  double Misfit(double share) const { return std::log(std::max(share, noise)); }
  double misfit() const { return Misfit(unexplained[0]) + Misfit(unexplained[1]); }

  /// Number of changes to the columns.
  int changes() const {
    const Reading& r = reading;
    return (r.sign[0] < 0) + (r.sign[1] < 0) + (r.link1 != 0) + r.swapped +
           (r.swapped != torques_swapped) + (r.unit != Joints{1, 1}) + (torque_sign[0] < 0) +
           (torque_sign[1] < 0) + (std::abs(zero[0]) > kZero) + (std::abs(zero[1]) > kZero);
  }
  double cost() const { return misfit() + torque_misfit + kChange * changes(); }
};

/// The equations of both joints for one reading of the angles.
struct Equations {
  std::array<Gram, 2> gram;

  void SetZero(Explanation& e, const Joints& zero) const {
    e.zero = zero;
    for (const int row : {0, 1})
      e.unexplained[row] = Unexplained(gram[row], row, zero, kInertia, 1);
  }

  /// Improves the zeros within `most` by steps of `step` (rad) and smaller ones.
  Explanation Improve(Explanation best, double step, double most) const {
    for (; step > 0.01; step /= 2) {
      for (const Joints& way : {Joints{1, 0}, {-1, 0}, {0, 1}, {0, -1}}) {
        Explanation next = best;
        const Joints& at = best.zero;
        SetZero(next, {std::clamp(at[0] + step * way[0], -most, most),
                       std::clamp(at[1] + step * way[1], -most, most)});
        if (next.misfit() < best.misfit()) best = next;
      }
    }
    return best;
  }

  /// Sets the joints and signs of the torques.
  void SetTorques(Explanation& e, const std::array<bool, 2>& has_torque) const {
    Explanation best = e;
    for (const bool swapped : {false, true}) {
      Explanation next = e;
      next.torques_swapped = swapped;
      for (const int row : {0, 1}) {
        const int column = swapped ? 1 - row : row;
        if (!has_torque[column]) continue;
        const Term term = column == 0 ? kTorque1 : kTorque2;
        const double as_is = e.Misfit(Unexplained(gram[row], row, e.zero, term, 1));
        const double turned = e.Misfit(Unexplained(gram[row], row, e.zero, term, -1));
        next.torque_sign[column] = turned < as_is - kChange ? -1 : 1;
        next.torque_misfit += next.torque_sign[column] < 0 ? turned : as_is;
      }
      if (!swapped || next.cost() < best.cost()) best = next;
    }
    e = best;
  }

  /// The best explanations with the columns' own zeros and with others.
  std::array<Explanation, 2> Explain(Explanation start,
                                     const std::array<bool, 2>& has_torque) const {
    SetZero(start, {});
    Explanation any = start;
    for (int i = -3; i <= 4; ++i) {
      for (int j = -3; j <= 4; ++j) {
        Explanation next = start;
        SetZero(next, {i * std::numbers::pi / 4, j * std::numbers::pi / 4});
        if (next.misfit() < any.misfit()) any = next;
      }
    }
    std::array<Explanation, 2> both{Improve(start, kZero / 2, kZero), Improve(any, 0.4, 4)};
    for (Explanation& e : both) SetTorques(e, has_torque);
    return both;
  }
};

/// All ways to read angles with these ranges; the first one changes nothing.
std::vector<Reading> Readings(const Joints& range) {
  constexpr double kLeast = 0.3, kMost = 100;  // rad
  constexpr double kTurn = 2 * std::numbers::pi, kDegree = kTurn / 360;
  std::vector<Reading> readings;
  for (const Joints& unit :
       {Joints{1, 1}, {kTurn, kTurn}, {kDegree, kDegree}, {kDegree, 1}, {1, kDegree}}) {
    if (std::ranges::any_of(std::array{0, 1}, [&](int j) {
          const double moves = unit[j] * range[j];
          return unit[j] != 1 && (moves < kLeast || moves > kMost);
        })) {
      continue;
    }
    for (const Joints& sign : {Joints{1, 1}, {1, -1}, {-1, 1}, {-1, -1}}) {
      for (const double link1 : {0, 1, -1}) {
        for (const bool swapped : {false, true}) {
          readings.push_back({sign, unit, link1, swapped});
        }
      }
    }
  }
  return readings;
}

/// Whether the joints move nearly in proportion, which several explanations allow.
bool InProportion(const std::vector<Window>& windows) {
  constexpr double kProportion = 0.95;
  Pairs pairs;
  for (const Window& window : windows) {
    pairs.Add(window.back().w[0] - window.front().w[0], window.back().w[1] - window.front().w[1]);
  }
  return std::abs(pairs.correlation()) > kProportion;
}

/// The joints with commands or pushes. Without either, those with measured torques: an idle motor
/// may report some, too, but less than the other.
std::array<bool, 2> DrivenJoints(Pieces pieces, const std::vector<Window>& windows) {
  std::array<bool, 2> driven{HasCommand(pieces, 0), HasCommand(pieces, 1)};
  for (const MachineLog& log : pieces) {
    for (const int j : {0, 1}) driven[j] = driven[j] || HasTorque(log.push, j);
  }
  if (driven[0] || driven[1]) return driven;
  Joints squares{};
  for (const Window& window : windows) {
    for (const Sample& sample : window) {
      for (const int j : {0, 1}) squares[j] += sample.tau[j] * sample.tau[j];
    }
  }
  constexpr double kShare = 0.25;  // of the larger square
  const double least = kShare * std::max(squares[0], squares[1]);
  return {squares[0] > least, squares[1] > least};
}

/// The share of the changes of velocity that the steps of the encoders make, of the joint with
/// more.
double NoiseOf(Pieces pieces, const std::vector<Window>& windows, double cycle) {
  const double apart = 2 * SpanOf(cycle) * cycle;
  double most = 2e-3;
  for (const int j : {0, 1}) {
    double changes = 0;
    for (const Window& window : windows) {
      changes += std::pow(window.back().w[j] - window.front().w[j], 2);
    }
    // Four rounded angles, each with a variance of a twelfth of the step's square.
    const double noise = std::pow(QuantumOf(pieces, j).value_or(0) / apart, 2) / 3;
    most = std::max(most, noise * static_cast<double>(windows.size()) / changes);
  }
  return most;
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

void DropTorques(std::vector<Window>& windows) {
  for (Window& window : windows) {
    for (Sample& sample : window) sample.tau = {};
  }
}

void Report(const Explanation& e, bool in_proportion, Findings& findings) {
  const auto add = [&](Aspect aspect, int joint, const std::string& text) {
    Reporter{findings, aspect, joint}(
        Severity::kFault,
        fmt::format("suspect {}: with it the motion is that of a pendulum{}", text,
                    in_proportion ? "; or another sign, joint or zero of angles or torques: the "
                                    "joints move in proportion"
                                  : ""));
  };
  const Reading& r = e.reading;
  if (r.swapped && e.torques_swapped) add(Aspect::kMotion, 0, "swapped columns of both joints");
  if (r.swapped && !e.torques_swapped) add(Aspect::kAngle, 0, "swapped angles");
  if (!r.swapped && e.torques_swapped) add(Aspect::kTorque, 0, "swapped torques");
  if (r.link1 != 0) {
    add(Aspect::kAngle, 2,
        r.link1 > 0 ? "an angle against the vertical (key absolute)"
                    : "an angle against link 1 (without key absolute)");
  }
  for (const int j : {0, 1}) {
    if (r.unit[j] != 1) {
      add(Aspect::kAngle, j + 1, r.unit[j] > 1 ? "turns (key unit)" : "degrees (key unit)");
    }
    if (r.sign[j] < 0) add(Aspect::kAngle, j + 1, "the opposite sign (factor = -1)");
    if (e.torque_sign[j] < 0) add(Aspect::kTorque, j + 1, "the opposite sign (factor = -1)");
    // The reading of a link that hangs, by the column's own sign.
    const double hangs = -r.sign[j] * (j == 1 ? e.zero[1] + r.link1 * e.zero[0] : e.zero[j]);
    if (std::abs(e.zero[j]) <= kZero) continue;
    const double zero = std::remainder(hangs, 2 * std::numbers::pi);
    add(Aspect::kAngle, j + 1,
        fmt::format("another zero, {:.2f} rad ({:.0f} deg) when its link {} (add it to the key "
                    "hanging, in the column's unit)",
                    zero, zero * 180 / std::numbers::pi,
                    j == 0 || r.link1 > 0 ? "hangs" : "is in line with link 1"));
  }
}

/// The best explanation of all ways to read the columns. `range` of both angles, rad.
Explanation BestOf(const std::vector<Window>& windows, const Joints& range, double noise,
                   const std::array<bool, 2>& has_torque) {
  std::vector<Explanation> all;
  for (const Reading& reading : Readings(range)) {
    const Equations equations{GramsOf(windows, reading)};
    for (const Explanation& e : equations.Explain({reading, noise}, has_torque)) all.push_back(e);
  }
  return *std::ranges::min_element(all, {}, &Explanation::cost);
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

}  // namespace

void CheckEquations(Pieces pieces, Findings& findings) {
  constexpr double kMoving = 0.5;  // rad
  constexpr size_t kEnough = 25;   // windows
  constexpr int kMostChanges = 3;
  constexpr double kGood = 0.1, kDriven = 0.03;  // unexplained
  constexpr double kNoisy = 10;                  // unexplained at most, of the noise
  const Joints range{AngleRange(pieces, 0), AngleRange(pieces, 1)};
  if (range[0] < kMoving || range[1] < kMoving) return;
  const double cycle = UsualCycle(pieces);
  if (!(cycle > 0)) return;
  std::vector<Window> windows = WindowsOf(pieces, cycle);
  if (windows.size() < kEnough) return;
  const double noise = NoiseOf(pieces, windows, cycle);
  const double most = std::max(kDriven, kNoisy * noise);  // unexplained, of a free pendulum
  std::optional<Explanation> unpowered_best;
  const bool free = IsFree(pieces);
  if (free || pieces.front().commanded.empty()) {
    std::vector<Window> unpowered = windows;
    DropTorques(unpowered);
    const Explanation found = BestOf(unpowered, range, noise, {});
    const bool is_free = std::max(found.unexplained[0], found.unexplained[1]) <= most;
    if (free && !is_free) return ReportDriven(pieces, findings);
    if (is_free) {  // idle motors report torques that have nothing to do with the motion
      windows = std::move(unpowered);
      unpowered_best = found;
    }
  }
  const std::array<bool, 2> has_torque = DrivenJoints(pieces, windows);
  const bool in_proportion = InProportion(windows);
  if (in_proportion && !has_torque[0] && !has_torque[1]) return;
  const Explanation best =
      unpowered_best ? *unpowered_best : BestOf(windows, range, noise, has_torque);
  const double unexplained = std::max(best.unexplained[0], best.unexplained[1]);
  if (best.changes() > kMostChanges || unexplained > kGood) return;
  // Torques that have nothing to do with the motion are no evidence.
  if (best.torque_misfit > -1.0 * (has_torque[0] + has_torque[1])) return;
  Report(best, in_proportion, findings);
}

}  // namespace upswing::machine
