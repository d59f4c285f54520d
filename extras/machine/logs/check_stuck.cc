// Finds encoders that stick, by the equations of motion (pendulum/equations.h). A joint at rest
// repeats its angle, too, but then the other joint moves as if the first one were fixed. The check
// fits the equation of the other joint to the rows in which both encoders change, and to those in
// which one does not. One set of parameters explains both if the joint rests.
#include <fmt/format.h>

#include <Eigen/Core>
#include <algorithm>
#include <array>
#include <cmath>
#include <functional>
#include <limits>
#include <numbers>
#include <optional>
#include <string>
#include <vector>

#include "extras/machine/logs/check.h"
#include "extras/machine/logs/check_terms.h"
#include "extras/machine/logs/smooth_motion.h"

namespace upswing::machine {
namespace {

constexpr double kRounding = 1e-9;  // rad, of angles that are equal in the file

/// Times of a log, s.
struct Times {
  double cycle;   // usual one
  double own;     // of the motion; see OwnTime
  double window;  // of an equation

  /// Nothing if the log has no usual cycle. The window is a third of a swing, which has a length of
  /// 2 π own times: shorter ones have more noise of the encoders, and longer ones miss short
  /// faults. A log without a swing counts as one of links of 20 cm.
  static std::optional<Times> Of(Pieces pieces) {
    constexpr double kOwn = 0.14, kWindow = 2.1;  // s, own times
    const double cycle = UsualCycle(pieces), found = OwnTime(pieces);
    if (!(cycle > 0)) return {};
    const double own = found > 0 ? found : kOwn;
    return Times{cycle, own, kWindow * own};
  }
};

/// Rows of a piece in which an angle does not change.
struct Stretch {
  const MachineLog* piece;
  int first, last;  // row indices

  double seconds() const { return piece->time[last] - piece->time[first]; }
};

/// The stretches, at least as long as a window, in which none of these joints' angles changes.
std::vector<Stretch> StretchesOf(Pieces pieces, const std::vector<int>& joints, double window) {
  std::vector<Stretch> stretches;
  for (const MachineLog& piece : pieces) {
    for (int first = 0; first < piece.rows();) {
      Stretch stretch{&piece, first, first};
      const auto repeats = [&](int k) {
        return k < piece.rows() && std::ranges::all_of(joints, [&](int joint) {
                 return std::abs(piece.angle[k][joint] - piece.angle[first][joint]) < kRounding;
               });
      };
      while (repeats(stretch.last + 1)) ++stretch.last;
      if (stretch.seconds() >= window) stretches.push_back(stretch);
      first = stretch.last + 1;
    }
  }
  return stretches;
}

/// The equation of one joint over a window: coefficient · term, summed, is 0. The coefficient of
/// the inertia is 1.
enum Coefficient {
  kOtherInertia,
  kCouples,
  kCouplesTurned,
  kGravity2,
  kGravity2Turned,
  kGravity1,
  kGravity1Turned,
  kViscous,
  kDry,
  kOwnTorque,
  kConstant,  // of the rows in which an encoder does not change: friction of a joint at rest
  kOwnInertia,
  kCoefficients
};
using Vector = Eigen::Matrix<double, kCoefficients, 1>;
using NormalMatrix = Eigen::Matrix<double, kCoefficients, kCoefficients>;

struct Equation {
  Vector terms;
  double unknown;           // weight of dry friction that the velocities leave unknown, s
  int first = 0, last = 0;  // row indices
};
using EquationList = std::vector<Equation>;

/// The unknown part of dry friction at a velocity (rad in an own time), as a share of the friction
/// of fast motion. At rest, friction is any torque up to a limit; how it grows in slow motion
/// differs.
double UnknownFriction(double w) {
  constexpr double kAtRest = 1.2, kSlow = 0.5, kFast = 0.02;  // shares, rad in an own time
  if (std::abs(w) < kRounding) return kAtRest;
  return std::abs(w) < kFast ? kSlow : 0;
}

/// The equations of joint `row` over windows within the rows `first` to `last`, `hop` (s) apart.
EquationList EquationsWithin(const MachineLog& log, int first, int last, int row, double hop,
                             const Times& times) {
  constexpr std::array kTerm{kOther, kCoupling,    kTurnedCoupling, kLink2,   kTurnedLink2,
                             kLink1, kTurnedLink1, kDamping,        kFriction};
  constexpr int kRows = 6;  // fewest in a window
  const double cycle = times.cycle;
  const int span = SpanOf(cycle);
  const int length = std::max(kRows, static_cast<int>(std::lround(times.window / cycle)));
  const int step = std::max(1, static_cast<int>(std::lround(hop / cycle)));
  last = std::min(last, log.rows() - 1 - span);
  EquationList equations;
  for (int k = std::max(first, span); k + length <= last; k += step) {
    const Window window = SmoothWindowAt(log, k, k + length, span, cycle);
    if (window.empty()) continue;
    const Terms terms = TermsOf(window)[row];
    Equation e{Vector::Zero(), 0, k, k + length};
    for (int i = 0; i < std::ssize(kTerm); ++i) e.terms[i] = terms[kTerm[i]];
    e.terms[kOwnTorque] = -terms[row == 0 ? kTorque1 : kTorque2];
    e.terms[kOwnInertia] = terms[kInertia];
    for (const Sample& s : window) {
      e.terms[kConstant] += s.force;
      e.unknown += s.force * UnknownFriction(times.own * s.w[row]);
    }
    equations.push_back(e);
  }
  return equations;
}

NormalMatrix MatrixOf(const EquationList& equations) {
  NormalMatrix gram = NormalMatrix::Zero();
  for (const Equation& e : equations) gram += e.terms * e.terms.transpose();
  return gram;
}

double InertiaIn(const EquationList& equations) {
  double sum = 0;
  for (const Equation& e : equations) sum += std::pow(e.terms[kOwnInertia], 2);
  return sum;
}

/// The coefficients with the least squares. Masses, lengths and friction are not negative.
Vector Solve(const NormalMatrix& gram) {
  Vector x = Vector::Zero();
  x[kOwnInertia] = 1;
  for (int sweep = 0; sweep < 500; ++sweep) {  // coordinate descent
    double moved = 0;
    for (int i = 0; i < kOwnInertia; ++i) {
      if (!(gram(i, i) > 0)) continue;
      const double before = x[i];
      x[i] -= gram.row(i).dot(x) / gram(i, i);
      const bool is_free = i == kCouplesTurned || i == kGravity2Turned || i == kGravity1Turned ||
                           i == kOwnTorque || i == kConstant;
      if (!is_free) x[i] = std::max(0.0, x[i]);
      moved = std::max(moved, gram(i, i) * (x[i] - before) * (x[i] - before));
    }
    if (moved < 1e-10) break;
  }
  return x;
}

/// The sum of squares that coefficients leave unexplained. At rest, dry friction is any torque up
/// to a limit.
double Remainder(const EquationList& equations, const Vector& x) {
  double sum = 0;
  for (const Equation& e : equations) {
    const double rest = std::abs(e.terms.dot(x)) - x[kDry] * e.unknown;
    sum += std::pow(std::max(0.0, rest), 2);
  }
  return sum;
}

/// The variance of a window's inertia term that the steps of both encoders make, (rad/s)². The
/// other joint may move within a step of its own, which counts twice.
double StepNoise(Pieces pieces, int row, double window) {
  double own = StepOf(pieces, row);
  double other = StepOf(pieces, 1 - row);
  // A joint that does not move shows no step: take the other one's.
  if (own <= 0) own = other;
  if (other <= 0) other = own;
  return (own * own + 2 * other * other) / 12 * std::pow(2 * std::numbers::pi / window, 2);
}

/// Whether the joint of these windows moves by far more than the noise (a variance).
bool MovesClearly(const EquationList& equations, double noise) {
  constexpr double kClear = 10;  // times the noise
  return InertiaIn(equations) > kClear * noise * static_cast<double>(equations.size());
}

/// Divides equations by the root of their number and by their largest terms, so that slow and fast
/// motions count the same. Adds the share that is noise (a variance) to `noise_share`.
EquationList Scaled(const EquationList& equations, const Vector& x, double noise,
                    double& noise_share) {
  constexpr double kClear = 30;  // times the noise that a term needs to count fully
  const double n = static_cast<double>(equations.size());
  EquationList scaled;
  for (const Equation& e : equations) {
    const double square =
        std::pow(e.terms.cwiseProduct(x).cwiseAbs().maxCoeff(), 2) + kClear * noise;
    if (!(square > 0)) continue;
    const double divisor = std::sqrt(square * n);
    scaled.push_back({e.terms / divisor, e.unknown / divisor});
    noise_share += noise / (square * n);
  }
  return scaled;
}

/// Whether no common coefficients explain the motion of a joint in `live` windows, in which the
/// encoder of the other joint changes, and in `stuck` ones, in which it does not.
bool Contradicts(EquationList live, EquationList stuck, double noise) {
  constexpr double kLeast = 0.006;  // unexplained share
  constexpr double kInexact = 1.5;  // of the unexplained share of the live windows
  const double all = InertiaIn(live);
  if (!(all > 0)) return false;
  const Vector first = Solve(MatrixOf(live) / all);
  double ignored = 0, noise_share = 0;
  live = Scaled(live, first, noise, ignored);
  stuck = Scaled(stuck, first, noise, noise_share);
  const NormalMatrix of_live = MatrixOf(live);
  const double unexplained = Remainder(live, Solve(of_live));
  const Vector common = Solve(of_live + MatrixOf(stuck));
  const double more = Remainder(live, common) + Remainder(stuck, common) - unexplained;
  return more > kLeast + noise_share + kInexact * unexplained;
}

/// Whether the motion is not that of a pendulum with a single joint.
bool NeedsTwoJoints(EquationList stuck, double noise) {
  constexpr double kLeast = 0.05;  // unexplained share
  constexpr size_t kEnough = 12;   // windows
  for (Equation& e : stuck) {
    for (const int i : {kOtherInertia, kCouples, kCouplesTurned, kConstant}) e.terms[i] = 0;
  }
  const double all = InertiaIn(stuck);
  if (stuck.size() < kEnough || !(all > 0)) return false;
  double noise_share = 0;
  stuck = Scaled(stuck, Solve(MatrixOf(stuck) / all), noise, noise_share);
  return Remainder(stuck, Solve(MatrixOf(stuck))) > kLeast + 2 * noise_share;
}

/// Whether torques that dry friction cannot hold act on a joint in `stuck` windows, in which
/// neither encoder changes. The coefficients come from windows in which both change.
bool MustMove(const EquationList& live, const EquationList& stuck) {
  constexpr double kAtRest = 1.5;  // largest friction at rest, of that in motion
  constexpr double kSigmas = 3;
  const double all = InertiaIn(live);
  if (!(all > 0) || stuck.empty()) return false;
  const Vector x = Solve(MatrixOf(live) / all);
  double least = std::numeric_limits<double>::infinity(), most = -least;
  for (const Equation& e : stuck) {
    const double torque = e.terms[kOwnTorque] * x[kOwnTorque] / e.terms[kConstant];
    least = std::min(least, torque);
    most = std::max(most, torque);
  }
  const double weight = stuck.front().terms[kConstant];
  const double inexact = std::sqrt(Remainder(live, x) / static_cast<double>(live.size())) / weight;
  return (most - least) / 2 > kAtRest * x[kDry] + kSigmas * inexact;
}

/// Removes the windows in which a stretch of a piece is.
void Drop(const std::vector<Stretch>& stretches, const MachineLog& piece, int span,
          EquationList& equations) {
  std::erase_if(equations, [&](const Equation& e) {
    return std::ranges::any_of(stretches, [&](const Stretch& s) {
      return s.piece == &piece && e.first - span <= s.last && e.last + span >= s.first;
    });
  });
}

/// The equations of joint `row` in windows in which both encoders change.
EquationList LiveOf(Pieces pieces, int row, const Times& times) {
  constexpr double kMost = 1000;  // windows; more would only take longer
  std::vector<Stretch> stretches = StretchesOf(pieces, {0}, times.window);
  const std::vector<Stretch> second = StretchesOf(pieces, {1}, times.window);
  stretches.insert(stretches.end(), second.begin(), second.end());
  double seconds = 0;
  for (const MachineLog& piece : pieces) seconds += piece.time.back();
  const double hop = std::max(times.window / 2, seconds / kMost);
  EquationList live;
  for (const MachineLog& piece : pieces) {
    EquationList all = EquationsWithin(piece, 0, piece.rows() - 1, row, hop, times);
    Drop(stretches, piece, SpanOf(times.cycle), all);
    live.insert(live.end(), all.begin(), all.end());
  }
  for (Equation& e : live) e.terms[kConstant] = 0;
  return live;
}

/// The equations of joint `row` in windows within a stretch.
EquationList StuckOf(const Stretch& stretch, int row, const Times& times) {
  constexpr double kMost = 1000;  // windows
  const int span = SpanOf(times.cycle);
  return EquationsWithin(*stretch.piece, stretch.first + span, stretch.last - span, row,
                         std::max(times.window / 4, stretch.seconds() / kMost), times);
}

/// The longest stretches, at most four, because more would only take longer.
std::vector<Stretch> LongestOf(std::vector<Stretch> stretches) {
  std::ranges::sort(stretches, std::ranges::greater(), &Stretch::seconds);
  if (stretches.size() > 4) stretches.resize(4);
  return stretches;
}

void ReportStuck(const std::vector<Stretch>& found, int joint, const std::string& reason,
                 Findings& findings) {
  if (found.empty()) return;
  const Stretch& longest = found.front();
  Reporter{findings, Aspect::kAngle, joint + 1}(
      Severity::kFault,
      fmt::format("the encoder sticks at {:.4g} rad: {}{}",
                  longest.piece->angle[longest.first][joint], reason,
                  found.size() > 1 ? fmt::format("; {} times, longest", found.size()) : ""),
      RangeOf(*longest.piece, longest.first, longest.last),
      {{"times", static_cast<double>(found.size())}});
}

/// The stretches of a joint in which the other joint moves as it does only if both move.
std::vector<Stretch> FindByMotion(Pieces pieces, int joint, const Times& times) {
  constexpr size_t kEnough = 12;  // live windows
  const int other = 1 - joint;
  const std::vector<Stretch> stretches = StretchesOf(pieces, {joint}, times.window);
  if (stretches.empty()) return {};
  const EquationList live = LiveOf(pieces, other, times);
  const std::vector<Stretch> still = StretchesOf(pieces, {other}, times.window);
  const double noise = StepNoise(pieces, other, times.window);
  std::vector<Stretch> found;
  for (const Stretch& stretch : LongestOf(stretches)) {
    EquationList stuck = StuckOf(stretch, other, times);
    Drop(still, *stretch.piece, SpanOf(times.cycle), stuck);
    if (!MovesClearly(stuck, noise)) continue;
    const bool moves =
        live.size() < kEnough ? NeedsTwoJoints(stuck, noise) : Contradicts(live, stuck, noise);
    if (moves) found.push_back(stretch);
  }
  return found;
}

/// The stretches in which neither angle changes although a joint's torque must move it.
std::vector<Stretch> FindByTorque(Pieces pieces, int joint, const Times& times) {
  constexpr size_t kEnough = 12;  // live windows
  const std::vector<Stretch> both = StretchesOf(pieces, {0, 1}, times.window);
  if (both.empty()) return {};
  const EquationList live = LiveOf(pieces, joint, times);
  if (live.size() < kEnough) return {};
  std::vector<Stretch> found;
  for (const Stretch& stretch : LongestOf(both)) {
    if (MustMove(live, StuckOf(stretch, joint, times))) found.push_back(stretch);
  }
  return found;
}

}  // namespace

void CheckStuck(Pieces pieces, Findings& findings) {
  const std::optional<Times> times = Times::Of(pieces);
  if (!times) return;
  for (const int joint : {0, 1}) {
    if (IsStuck(findings, joint)) continue;
    const std::vector<Stretch> by_motion = FindByMotion(pieces, joint, *times);
    if (!by_motion.empty()) {
      ReportStuck(by_motion, joint,
                  fmt::format("joint {} moves as it does only if this joint moves", 2 - joint),
                  findings);
      continue;
    }
    ReportStuck(FindByTorque(pieces, joint, *times), joint,
                "neither angle changes, although torques beyond dry friction act", findings);
  }
}

}  // namespace upswing::machine
