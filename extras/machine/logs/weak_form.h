#pragma once

#include <Eigen/Core>
#include <array>
#include <functional>
#include <span>
#include <vector>

#include "extras/machine/logs/log.h"
#include "extras/machine/logs/smooth_motion.h"

/// The equations of motion of a log in weak form: multiplied by a smooth weight and integrated over
/// windows, they need no accelerations. They are linear in the constants of Manipulator
/// (pendulum/regressor.h), so each way to read a log is fitted at once.
namespace upswing::machine {

/// A way to read the angles: operations on the columns of the file, in this order.
struct AngleReading {
  // Whether the column of joint 2 has angles against the vertical, from which the log subtracted
  // those of joint 1.
  bool absolute = false;
  Joints scale{1, 1};
  double link1 = 0;  // angles of joint 1 that are in those of joint 2; 1: against the vertical
  bool swapped = false;
  Joints zero{};         // added at the end, rad
  double late = 0;       // time by which angle 2 is behind angle 1, s
  Joints turn{};         // added after a moment of the log, or more and more, rad
  double turns_at = -1;  // this moment, as a place in the log from 0 to 1; negative: more and more

  /// Angles without the zeros and turns, or velocities, of both joints.
  Joints Of(const Joints& x) const {
    const Joints column{x[0], absolute ? x[0] + x[1] : x[1]};
    Joints y{scale[0] * column[swapped ? 1 : 0], scale[1] * column[swapped ? 0 : 1]};
    y[1] -= (absolute ? 1 + link1 : link1) * y[0];
    return y;
  }
  /// The share of the turns that is added at a place in the log: none at its beginning.
  double TurnedAt(double place) const {
    if (turns_at < 0) return place;
    return place > turns_at ? 1 : 0;
  }
};

/// A way to read the torques.
struct TorqueReading {
  Joints sign{1, 1};
  bool swapped = false;
  Joints largest{};         // the motors saturate there, N·m; 0: they do not
  Joints dead_band{};       // torques that do not arrive, N·m
  bool only_small = false;  // whether torques beyond the dead band arrive whole
  double flips_at = -1;     // the signs turn at this share of the log; negative: never
};

/// The torques of a log over time, as their integrals.
class TorqueIntegral {
 public:
  /// The measured torques, or the commands and pushes of a log without.
  /// `before`: time of the log before this piece. `seconds`: length of the whole log, s.
  TorqueIntegral(const MachineLog& log, const TorqueReading& reading, double before,
                 double seconds);
  /// The integral from the beginning to a time (s), N·m·s. Fast for times near that of the last
  /// call.
  Joints At(double time);

 private:
  std::vector<double> time_;
  std::vector<Joints> integral_;
  int next_ = 1;  // first row after the time of the last call
};

/// Columns of the equations: the constants of the motion, small zeros of both encoders, and the
/// torques.
namespace weak {
enum Column {
  kJ1,
  kJ2,
  kB,
  kA,
  kG1,
  kG2,
  kD1,
  kD2,
  kF1,
  kF2,
  kTorque1,
  kTorque2,
  kZero1,
  kZero12,
  kZeroB,
  kColumns
};
}

/// The weak equations of joint 1 and joint 2: A x = 0 for the constants x. A has a row for each
/// window.
struct WeakEquations {
  std::array<Eigen::MatrixXd, 2> A;  // (windows × columns) N·m, for columns of constants of 1
  std::vector<double> when;          // (windows) middle, as a place in the log from 0 to 1
  double length = 0;                 // of a window, as a share of the log

  int windows() const { return static_cast<int>(when.size()); }
  /// The equations of the windows for which `keeps`, called with their indices, is true.
  WeakEquations Selected(const std::function<bool(int row)>& keeps) const;
};

/// The windows of a log in which it moves.
class WeakForm {
 public:
  /// `time`: natural time of the machine, s.
  WeakForm(std::span<const MachineLog> pieces, double time);

  int windows() const { return static_cast<int>(windows_.size()); }
  double time() const { return time_; }
  /// The integral of a window's weight, s.
  double weight() const { return weight_.sum(); }
  /// The variance of the integral of φ' ẋ over a window for noise with a variance of 1 on x in each
  /// row, `cycle` (s) apart.
  double NoiseGain(double cycle) const;
  /// The same form with `most` windows at most.
  WeakForm Thinned(int most) const;
  /// The equations with the torques `delay` (s) later.
  WeakEquations Equations(const AngleReading& angles, const TorqueReading& torques,
                          double delay) const;
  /// Replaces the columns of the torques.
  void SetTorques(const TorqueReading& torques, double delay, WeakEquations& equations) const;

 private:
  /// Angles and velocities of both joints, rad and rad/s.
  struct Sample {
    Joints q, w;
  };
  struct Window {
    int piece;
    double begin;                 // s
    std::vector<Sample> samples;  // (points)
  };

  void FindWindows(double quiet);
  double LongestGap(const SmoothMotion& motion) const;
  /// The samples of a window whose angles 2 are `late` (s).
  std::vector<Sample> SamplesOf(int piece, double begin, double late) const;
  /// `place`: of the window in the log, from 0 to 1.
  void SetMotion(const AngleReading& reading, const Window& window, double place, int row,
                 WeakEquations& equations) const;

  std::span<const MachineLog> pieces_;
  double time_, length_, step_ = 0;    // of windows, of their points, s
  std::vector<SmoothMotion> motions_;  // (pieces)
  std::vector<Window> windows_;
  Eigen::VectorXd weight_, slope_;  // (points) of the windows: φ dt, φ' dt
};

/// Zeros of the angles that a fit finds, rad: of link 1 and of link 2 against the vertical, by
/// gravity, and of joint 2, by the coupling of the links.
struct Zeros {
  double link1, link2, joint2;
};

/// A fit of the constants to weak equations.
struct WeakFit {
  Eigen::VectorXd constants;  // (columns), up to a common factor
  // (joints) share of the squares of inertial forces and gravity that the equations leave
  // unexplained.
  Joints unexplained{1, 1};
  Joints motion{};     // (joints) mean of these squares, in units of the constants
  double freedom = 1;  // share of the equations that is not used up by constants

  /// The unexplained share of the joint with more.
  double left() const;
  Zeros zeros() const;
  /// Sum of the logarithms of both shares; below a limit all count the same.
  double misfit() const;
};

/// Fits the constants. Inertias, gravity, friction and the effect of torques are not negative.
/// `free`: more columns (windows × k) for each joint, whose coefficients have any sign.
WeakFit Fit(const WeakEquations& equations, const std::array<Eigen::MatrixXd, 2>& free = {});

/// The same with any zeros of the angles and signs of the torques: the columns of gravity, coupling
/// and torques have any sign.
WeakFit FitAnyZeroAndSign(const WeakEquations& equations);

/// The natural time of these constants, s, whatever the zeros of the angles.
double NaturalTimeOf(const Eigen::VectorXd& constants);

}  // namespace upswing::machine
