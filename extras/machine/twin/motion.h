#pragma once

#include <Eigen/Core>
#include <span>
#include <vector>

#include "extras/machine/logs/log.h"
#include "extras/machine/twin/cogging.h"
#include "extras/machine/twin/drive.h"
#include "extras/machine/twin/twin.h"
#include "pendulum/equations.h"
#include "pendulum/regressor.h"

/// A twin's motion under the torques of a log.
namespace upswing::machine {

/// Rows of the derivatives of a motion: by the start state (q1, q2, w1, w2), the constants of
/// Manipulator in their order, the drive's times, the offsets of the torques, the coefficients of
/// cogging and the encoders' zeros. Cogging depends on the zeros; other motions
/// do not.
namespace tangent {
enum Row {
  kStart = 0,
  kBody = kStart + 4,
  kDelay = kBody + kNumManipulatorConstants,
  kLag,
  kOffset,
  kCogging = kOffset + 2,
  kZero = kCogging + 2 * Cogging::kCoefficients,
  kRows = kZero + 2,
};
}
inline constexpr int kMostTangents = tangent::kRows;

/// The values of a model for which there are derivatives. Each detail has those of the details
/// before it.
enum class Detail { kUsual, kOffsets, kCogging };

/// A point of a motion.
struct MotionPoint {
  double time;  // s
  PendulumState state;
  Joints acceleration;  // rad/s²
};

/// A matrix with a row for each derivative of a motion.
template <int kColumns>
using TangentMatrix =
    Eigen::Matrix<double, Eigen::Dynamic, kColumns, Eigen::ColMajor, kMostTangents, kColumns>;

/// The derivatives of a point.
struct PointTangents {
  TangentMatrix<4> state;  // q1, q2, w1, w2
  TangentMatrix<2> acceleration;
};

/// Longest step of the integration, s, unless friction needs a shorter one: a fit would mistake the
/// errors of longer ones for delay.
inline constexpr double kMotionStep = 0.0005;
inline constexpr double kShortestMotionStep = kMotionStep / 64;

/// The links and motors of a twin as equations of motion, with cogging and offsets.
struct Body : Manipulator {
  CoggingTorque cogging;
  Joints offset{};                    // torques besides the drives', N·m
  double longest_step = kMotionStep;  // of the integration (Runge-Kutta of order 4), s
  Detail detail = Detail::kUsual;     // of the derivatives of its motions

  /// Number of derivatives of its motions.
  int tangents() const;
  /// q̈ (rad/s²) under the torques (N·m) of the drives at both joints.
  Joints Acceleration(const PendulumState& s, const Joints& torque) const;
};

/// Integrates the motion of a body under the torques of a drive. Both must outlive it.
class MotionIntegrator {
 public:
  MotionIntegrator(const Body& body, const Drive& drive) : body_(body), drive_(drive) {}

  /// The point in a state at a time (s).
  MotionPoint Start(double time, const PendulumState& state);
  /// The same with its derivatives.
  MotionPoint Start(double time, const PendulumState& state, PointTangents& tangents);
  /// The point after a step of Runge-Kutta of order 4 of length `h` (s).
  MotionPoint Step(const MotionPoint& now, double h);
  /// The same. `tangents`: in, of the point before the step; out, of the point after it.
  MotionPoint Step(const MotionPoint& now, double h, PointTangents& tangents);

 private:
  const Body& body_;
  const Drive& drive_;
  int cursor_ = 0;
};

/// The equations of motion of a twin. `reported`: driven by reported torques instead of commanded
/// ones. Reported torques lack current_inertia · q̈, so each joint has less armature.
Body BodyOf(const Twin& twin, bool reported = false);

/// A twin as the model of a log: its body, its torques over the time of the log, and its encoders.
struct MotionModel {
  Body body;
  Drive drive;
  Joints zero{};  // measured angles of joints that hang, rad
};
/// The model of a twin that the log's commands drive.
MotionModel CommandedModel(const MachineLog& log, const Twin& twin);
/// The model of a twin that the log's reported torques drive.
MotionModel ReportedModel(const MachineLog& log, const Twin& twin);

/// A predicted motion at n moments.
struct Motion {
  std::vector<Joints> angle;         // (n) as the encoders would show them, rad
  std::vector<Joints> velocity;      // (n) rad/s
  std::vector<Joints> acceleration;  // (n) of late moments, rad/s²
};

/// Derivatives of a predicted motion. Columns 2k and 2k + 1 are of the joints at moment k.
struct MotionTangents {
  Eigen::MatrixXd angle, acceleration;
  std::vector<Joints> jerk;  // (n) rad/s³, where `acceleration` is
};

/// Number of equal steps of a body's motion for a time of `seconds`, at least 1.
int MotionSteps(const Body& body, double seconds);

/// The motion at the moments `times` (n; s, growing), from a state at the first one. The state's
/// angles are measured ones. `late`: time from a moment of `acceleration` to the moment of the
/// angles, s. `tangents` are filled unless null.
Motion Predict(const MotionModel& model, const PendulumState& start, std::span<const double> times,
               double late = 0, MotionTangents* tangents = nullptr);

}  // namespace upswing::machine
