#pragma once

#include <Eigen/Core>
#include <optional>

#include "extras/machine/motion.h"
#include "extras/machine/simulated_machine.h"
#include "extras/machine/twin.h"
#include "pendulum/plant.h"

/// Estimates of a machine's state from the angles that its encoders report.
namespace upswing::machine {

/// Estimates the state in each cycle. A cycle sends the torques of the cycle before and reads the
/// angles at the same time.
///
/// Without a twin, velocities are low-passed differences of the angles (VelocityEstimate).
///
/// With a twin, an extended Kalman filter follows the twin's motion under the sent torques:
///   x = (q1, q2, w1, w2, z1, z2, f1, f2),   measured angles = (q1 + z1, q2 + z2)
/// z are the encoders' zeros and f the dry friction, which differ from session to session. They
/// begin at the twin's values. Those with a covariance are estimated: gravity and friction show in
/// the motion. The model lacks pushes and static friction. While they may act, a larger noise of
/// the velocities makes the filter follow the angles and change z and f little. Innovations that
/// keep their sign show a push (whiteness test of Bar-Shalom, Li, and Kirubarajan, Estimation with
/// Applications to Tracking and Navigation, 2001, 5.4). Outliers among the innovations are clipped.
///
/// The prediction bridges lost readings. The controller gets the state at the time when its torque
/// will act: a cycle, the motors' delay and their lag later.
///
/// No function allocates memory after the constructor.
class Estimator {
 public:
  /// `sensors`: low-pass and dead zone; used without a twin. `period`: of the cycles, s.
  Estimator(const MachineSensors& sensors, double period);
  Estimator(const Twin& twin, double period);

  /// Takes the torques (N·m) sent at a time (s), and a new reading if there is one.
  void Update(double time, const Joints& sent, const TimedReading* reading);

  /// The estimated state now: true angles, without the encoders' zeros.
  const PendulumState& now() const { return now_; }
  /// The estimated state when a torque that is computed now will act.
  const PendulumState& ahead() const { return ahead_; }
  /// The estimated zeros of the encoders, rad.
  Joints zero() const { return {x_[kZero], x_[kZero + 1]}; }
  /// The estimated dry friction f in f atan(100 w), N·m; 0 without a twin.
  Joints friction() const { return {x_[kFriction], x_[kFriction + 1]}; }
  /// The torques (N·m) that compensate a share of each joint's estimated dry friction, when they
  /// act.
  Joints CompensationTorque(double share) const;
  /// Mechanical energy now, 0 hanging at rest and 1 upright at rest; 0 without a twin.
  double energy() const;

 private:
  static constexpr int kAngle = 0, kVelocity = 2, kZero = 4, kFriction = 6, kStates = 8;
  using Vector = Eigen::Matrix<double, kStates, 1>;
  using Matrix = Eigen::Matrix<double, kStates, kStates>;

  struct Model {
    Manipulator body;
    Drive drive;
    double horizon;  // from sending a torque to its effect, s
    double hanging;  // energy below upright of the links that hang, J
  };
  /// x after `seconds` of the twin's motion from x at `begin` (s).
  Vector Follow(Vector x, double begin, double seconds) const;
  /// Takes a reading of finite angles. `driven`: whether torques were sent.
  void Take(const TimedReading& reading, bool driven);
  /// Standard deviation of measured angles, rad.
  double AngleNoise() const;
  /// Begins with measured angles of a moment (s). Zeros and friction stay.
  void Begin(const Joints& angle, double moment);
  /// Lets the filter follow the motion for `seconds`.
  void Predict(double seconds);
  /// Corrects x with measured angles, `seconds` after the last ones.
  void Correct(const Joints& angle, double seconds);
  /// Whether static friction may hold both links.
  bool Slow() const;

  MachineSensors sensors_;
  double period_;
  VelocityEstimate velocity_;
  std::optional<Model> model_;
  std::optional<double> begin_;  // time of the last Begin, s
  double time_ = 0;              // of x_, s
  Vector x_ = Vector::Zero();
  Matrix P_ = Matrix::Zero();                                  // covariance of x_
  Eigen::Vector2d mean_innovation_ = Eigen::Vector2d::Zero();  // normalized, low-passed
  double disturbed_until_ = 0;                                 // s
  PendulumState now_, ahead_;
};

}  // namespace upswing::machine
