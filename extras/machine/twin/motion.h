#pragma once

#include <Eigen/Core>
#include <vector>

#include "extras/machine/logs/log.h"
#include "extras/machine/twin/twin.h"
#include "pendulum/equations.h"

/// A twin's motion under the torques of a log.
namespace upswing::machine {

/// Derivatives of the torques of a drive, N·m/s.
struct DriveTangents {
  Joints by_delay{}, by_lag{};
};

/// The torques (N·m) at both joints over the time of a log.
class Drive {
 public:
  /// The torques that follow from the log's commands and pushes through the twin's motors; none if
  /// the log has no commands.
  static Drive Commanded(const MachineLog& log, const Twin& twin);
  /// The torques that the motors reported, interpolated and moved back by their age.
  static Drive Measured(const MachineLog& log, const Twin& twin);

  /// No torques yet, for motors with this delay and lag (s).
  Drive(double delay, double lag);
  /// Sends a command (N·m) at a time (s), later than those before it.
  void Add(double time, const Joints& command);
  /// Forgets commands that no longer matter at `time` and later.
  void Forget(double time);

  /// The torques at a time (s). `cursor`, first 0, speeds up calls with growing times. `tangents`,
  /// of a drive of commands, are filled unless null.
  Joints At(double time, int& cursor, DriveTangents* tangents = nullptr) const;

 private:
  /// Index of the last event up to a time; -1: before the first.
  int Find(double time, int& cursor) const;

  double delay_, lag_;            // s
  std::vector<double> times_;     // (n) of the events, s
  std::vector<Joints> commands_;  // (n) from each event on, N·m; or the values at the events
  std::vector<Joints> starts_;    // (n) torques at each event, N·m; empty: interpolated values
  std::vector<Joints> slopes_;    // (n) their derivatives by the lag, N·m/s
};

/// Number of values that a motion has derivatives by: the start's q1, q2, w1, w2; the constants of
/// Manipulator in their order; delay and lag of the drive.
inline constexpr int kTangents = 16;

/// Derivatives of a state and of its acceleration. A row for each value.
struct StepTangents {
  Eigen::Matrix<double, kTangents, 4> state;  // q1, q2, w1, w2
  Eigen::Matrix<double, kTangents, 2> acceleration;
};

/// One step of Runge-Kutta of order 4 of length `h` (s) from `time` (s), under the torques of a
/// drive. `acceleration` (rad/s²): in, of the state before the step; out, of the state after it.
/// `tangents`, unless null, change as both.
PendulumState StepMotion(const Manipulator& body, const Drive& drive, const PendulumState& now,
                         double time, double h, int& cursor, Joints& acceleration,
                         StepTangents* tangents = nullptr);

/// The equations of motion of a twin. `reported`: driven by reported torques instead of commanded
/// ones. Reported torques lack current_inertia · q̈, so each joint has less armature.
Manipulator BodyOf(const Twin& twin, bool reported = false);

/// A predicted motion at the rows of a log.
struct Motion {
  std::vector<Joints> angle;         // as the encoders would show them, rad
  std::vector<Joints> velocity;      // rad/s
  std::vector<Joints> acceleration;  // rad/s², current_delay before each row
};

/// Derivatives of a predicted motion. Columns 2k and 2k + 1 are of the joints in row k.
struct MotionTangents {
  Eigen::Matrix<double, kTangents, Eigen::Dynamic> angle, acceleration;
  std::vector<Joints> jerk;  // rad/s³, where `acceleration` is
};

/// Longest step of the integration (Runge-Kutta of order 4), s. Dry friction needs short steps: a
/// fit would mistake the errors of longer ones for delay.
inline constexpr double kMotionStep = 0.0005;
/// Number of equal steps for a time of `seconds`, at least 1.
int MotionSteps(double seconds);

/// The motion from row `first` to before row `last`, from a state at the first row's time. The
/// state's angles are measured ones: joints that hang show Twin::sensors' zeros.
/// `acceleration_age`: time before each row for which `acceleration` is filled, s. `tangents` are
/// filled unless null.
void Predict(const Manipulator& body, const Drive& drive, const Joints& zero,
             const PendulumState& start, const MachineLog& log, int first, int last,
             double acceleration_age, Motion& motion, MotionTangents* tangents = nullptr);

}  // namespace upswing::machine
