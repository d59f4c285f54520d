#pragma once

#include <Eigen/Core>
#include <array>
#include <vector>

#include "extras/machine/logs/log.h"

/// The terms of the equations of motion (pendulum/equations.h) over windows of a log, for checks
/// that fit the unknown parameters.
namespace upswing::machine {

/// Angles (rad), velocities (rad/s) and torques (N·m) at a row, with its weights in an integral.
struct Sample {
  double force;     // weight of forces, s
  double momentum;  // weight of momenta; over a window they sum up to a change of momentum
  Joints q, w, tau;
};
using Window = std::vector<Sample>;

/// Rows of a difference of angles to either side, for a usual cycle (s).
int SpanOf(double cycle);

/// The rows `first` to `last` of a log, which has `span` more rows on both sides; empty if a cycle
/// is lost in them. Velocities are differences of the angles `span` rows before and after. The
/// torques are the measured ones, or the commands and pushes of a log without.
Window WindowAt(const MachineLog& log, int first, int last, int span, double cycle);

/// As WindowAt, with the weight sin² that is 0 at both ends: its integrals average the steps of
/// encoders.
Window SmoothWindowAt(const MachineLog& log, int first, int last, int span, double cycle);

/// Terms of an equation of motion, integrated over a window: changes of momenta, and torques.
enum Term {
  kInertia,
  kOther,
  kCoupling,
  kTurnedCoupling,
  kLink2,
  kTurnedLink2,
  kLink1,
  kTurnedLink1,
  kDamping,
  kFriction,
  kTorque1,
  kTorque2,
  kTerms
};
using Terms = Eigen::Matrix<double, kTerms, 1>;

/// The terms of the equations of both joints over a window. Each sum equals the joint's torque.
///
/// Joint 1: d/dt [(J1 + J2) w1 + J2 w2 + b cos q2 (2 w1 + w2)] + G1 sin q1 + G2 sin(q1 + q2) + …
///
/// Joint 2: d/dt [J2 (w1 + w2) + a w2 + b cos q2 w1] + b sin q2 w1 (w1 + w2) + G2 sin(q1 + q2) + …
///
/// The turned terms are those with the angles a quarter turn ahead.
std::array<Terms, 2> TermsOf(const Window& window);

}  // namespace upswing::machine
