// Checks of signs by the equations of motion (pendulum/equations.h), whose parameters are unknown:
// least squares find them.
#include <Eigen/Dense>
#include <algorithm>
#include <array>
#include <cmath>

#include "extras/machine/check.h"
#include "extras/machine/pairs.h"

namespace upswing::machine {
namespace {

/// Angles, velocities and accelerations of both joints at a row, and a motor's torque, N·m.
struct Moment {
  Joints q, w, a;
  double tau;
};

/// The motion at row k from angles `span` rows before and after; false where cycles are uneven.
bool MomentAt(const MachineLog& log, int k, int span, int motor, Moment& moment) {
  const double before = log.time[k] - log.time[k - span], after = log.time[k + span] - log.time[k];
  if (!(before > 0) || std::abs(after - before) > 0.2 * before) return false;
  for (const int j : {0, 1}) {
    const double rise = (log.angle[k + span][j] - log.angle[k][j]) / after;
    const double fall = (log.angle[k][j] - log.angle[k - span][j]) / before;
    moment.q[j] = log.angle[k][j];
    moment.w[j] = (rise + fall) / 2;
    moment.a[j] = 2 * (rise - fall) / (before + after);
  }
  moment.tau = 0;
  if (motor < 0) return true;
  const auto& torque = log.measured.empty() ? log.commanded : log.measured;
  for (int i = k - span; i <= k + span; ++i) moment.tau += torque[i][motor] / (2 * span + 1);
  return true;
}

std::vector<Moment> MomentsFrom(Pieces pieces, int motor) {
  constexpr double kSpan = 0.01;   // s
  constexpr size_t kMost = 20000;  // moments; more would only take longer
  const int span = std::max(1, static_cast<int>(std::lround(kSpan / UsualCycle(pieces))));
  std::vector<Moment> moments;
  for (const MachineLog& log : pieces) {
    for (int k = span; k + span < log.rows() && moments.size() < kMost; ++k) {
      Moment moment;
      if (MomentAt(log, k, span, motor, moment)) moments.push_back(moment);
    }
  }
  return moments;
}

/// A least-squares fit: the share of the variance that stays unexplained, and the coefficients.
struct LinearFit {
  double rest = 1;
  Eigen::VectorXd coefficients;

  /// Whether the coefficients of coupling and gravity (and inertia, if it has one) have this sign.
  bool HasSign(double sign) const {
    return sign * coefficients[0] > 0 && sign * coefficients[1] > 0 &&
           (coefficients.size() < 7 || sign * coefficients[6] > 0);
  }
};

/// Fits one row of the equations of motion, that of joint `row`, with `sign` of joint 2's angle.
/// Without `torque` the row's joint has no motor: the first acceleration is the fit's target.
LinearFit FitRow(const std::vector<Moment>& moments, int row, double sign, bool torque) {
  constexpr int kTerms = 6;
  Eigen::MatrixXd X(moments.size(), kTerms + (torque ? 1 : 0));
  Eigen::VectorXd y(moments.size());
  for (int i = 0; i < static_cast<int>(moments.size()); ++i) {
    const auto& [q, w, a, tau] = moments[i];
    const double q2 = sign * q[1], w2 = sign * w[1], a2 = sign * a[1];
    const double s2 = std::sin(q2), c2 = std::cos(q2), s12 = std::sin(q[0] + q2);
    // Row 1: (J1 + J2) q̈1 + J2 q̈2 + b (2 c2 q̈1 + c2 q̈2 - s2 (2 w1 + w2) w2) + G1 s1 + G2 s12 + …
    // Row 2: J2 (q̈1 + q̈2) + a q̈2 + b (c2 q̈1 + s2 w1²) + G2 s12 + …
    const double first = row == 0 ? a[0] : a[0] + a2;
    const double speed = row == 0 ? w[0] : w2;
    const double terms[] = {row == 0 ? 2 * c2 * a[0] + c2 * a2 - s2 * (2 * w[0] + w2) * w2
                                     : c2 * a[0] + s2 * w[0] * w[0],
                            s12,
                            row == 0 ? std::sin(q[0]) : 0,
                            row == 0 ? a2 : 0,
                            speed,
                            std::tanh(10 * speed)};
    y[i] = torque ? tau : first;
    for (int term = 0; term < kTerms; ++term) X(i, term) = terms[term];
    if (torque) X(i, kTerms) = first;
  }
  LinearFit fit;
  fit.coefficients = X.completeOrthogonalDecomposition().solve(y);
  const double variance = (y.array() - y.mean()).matrix().squaredNorm();
  if (variance > 0) fit.rest = (y - X * fit.coefficients).squaredNorm() / variance;
  return fit;
}

/// The joint (0 or 1) with the only motor; -1 without torques, 2 if both joints have some.
int MotorOf(Pieces pieces) {
  bool has[2] = {};
  for (const MachineLog& piece : pieces) {
    for (const int j : {0, 1})
      has[j] = has[j] || HasTorque(piece.commanded, j) || HasTorque(piece.push, j);
  }
  return has[0] && has[1] ? 2 : has[0] ? 0 : has[1] ? 1 : -1;
}

}  // namespace

void CheckSigns(Pieces pieces, Findings& findings) {
  constexpr size_t kEnough = 200;                   // moments
  constexpr double kGood = 0.15, kPlausible = 0.3;  // unexplained
  constexpr double kBetter = 0.25;                  // share of the other sign's
  if (AngleRange(pieces, 0) < 0.5 || AngleRange(pieces, 1) < 0.5) return;
  const int motor = MotorOf(pieces);
  const std::vector<Moment> moments = MomentsFrom(pieces, motor == 2 ? -1 : motor);
  if (motor == 2 || moments.size() < kEnough) return;
  // In a single mode the joints move in proportion, which is plausible with either sign.
  constexpr double kSingleMode = 0.95;
  Pairs pairs;
  for (const Moment& m : moments) pairs.Add(m.a[0], m.a[1]);
  if (std::abs(pairs.correlation()) > kSingleMode) return;
  const int passive = motor == 1 ? 0 : 1;
  // Without a torque, the target is minus the other terms.
  const LinearFit as_is = FitRow(moments, passive, 1, false);
  const LinearFit turned = FitRow(moments, passive, -1, false);
  if (turned.rest < kGood && turned.rest < kBetter * as_is.rest && turned.HasSign(-1)) {
    findings.push_back({Aspect::kAngle, 2, Severity::kFault,
                        "suspect the opposite sign: with it the motion is that of a pendulum"});
    return;
  }
  if (motor < 0) return;
  const LinearFit fit = FitRow(moments, motor, 1, true);
  if (fit.rest < kPlausible && fit.HasSign(-1)) {
    findings.push_back({Aspect::kTorque, motor + 1, Severity::kFault,
                        "accelerates against its direction: suspect the opposite sign"});
  }
}

}  // namespace upswing::machine
