#pragma once

#include <Eigen/Core>
#include <algorithm>
#include <array>
#include <optional>

#include "extras/machine/drive/expectation.h"
#include "extras/machine/twin/motion.h"
#include "extras/machine/twin/simulated_machine.h"
#include "extras/machine/twin/twin.h"
#include "pendulum/plant.h"

/// Estimates of a machine's state from the angles that its encoders report.
namespace upswing::machine {

/// Where the state comes from that the controller gets.
enum class StateSource { kTwin, kDifferences };

/// Estimates the state in each cycle. A cycle sends the torques of the cycle before and reads the
/// angles at the same time.
///
/// Without a twin, velocities are low-passed differences of the angles (VelocityEstimate).
///
/// With a twin, an extended Kalman filter follows the twin's motion under the sent torques:
///   x = (q1, q2, w1, w2, z1, z2, f1, f2, o1, o2),   measured angles = (q1 + z1, q2 + z2)
/// z are the encoders' zeros, f the dry friction and o the offsets of the torques, which differ
/// from session to session. They begin at the twin's values. Values with a covariance are
/// estimated: gravity and friction show in the motion. The model lacks pushes and static friction.
/// While they may act, a larger noise of the velocities makes the filter follow the angles and
/// change z, f and o little. Innovations that keep their sign show a push (whiteness test of
/// Bar-Shalom, Li, and Kirubarajan, Estimation with Applications to Tracking and Navigation,
/// 2001, 5.4). Outliers among the innovations are clipped.
///
/// The prediction bridges lost readings. The controller gets the state at the time when its torque
/// will act: when it is sent, and the motors' delay and their lag later.
///
/// Noise and times are tuned on RealAIGym's machines. For twins of another size they count in
/// natural units (ScaleOverUsual).
///
/// The twin also says what the encoders have to show (Expectation).
///
/// No function allocates memory after the constructor.
class Estimator {
 public:
  /// `sensors`: low-pass and dead zone; used without a twin. `period`: of the cycles, s.
  Estimator(const MachineSensors& sensors, double period);
  /// `source`: where the controller's state comes from.
  Estimator(const Twin& twin, double period, StateSource source = StateSource::kTwin);

  /// Changes the usual time between two cycles, and the time from a reading to sending the torques
  /// that answer it, s. At first both are the period of the cycles.
  void SetTimes(double period, double latency) {
    period_ = period;
    latency_ = latency;
  }
  /// Takes the torques (N·m) sent at a time (s), later than those before.
  void Send(double time, const Joints& torque);
  /// Estimates the state at a time (s), with a new reading if there is one.
  void Update(double time, const TimedReading* reading);
  /// Takes the torques (N·m) sent at a time (s), and a new reading if there is one.
  void Update(double time, const Joints& sent, const TimedReading* reading) {
    Send(time, sent);
    Update(time, reading);
  }

  /// The estimated state now: true angles, without the encoders' zeros.
  const PendulumState& now() const { return now_; }
  /// The estimated state when a torque that is computed now will act.
  const PendulumState& ahead() const { return ahead_; }
  /// The zeros of the encoders behind now(), rad.
  Joints zero() const;
  /// The estimated dry friction f in f atan(100 w), N·m; 0 without a twin.
  Joints friction() const { return {track_.x[kFriction], track_.x[kFriction + 1]}; }
  /// The estimated offsets of the torques, N·m; 0 without a twin.
  Joints offset() const { return {track_.x[kOffset], track_.x[kOffset + 1]}; }
  const Expectation& expectation() const { return expectation_; }
  /// The torques (N·m) that compensate a share of each joint's estimated dry friction and offset,
  /// when they act.
  Joints CompensationTorque(double share) const;
  /// Mechanical energy now, 0 hanging at rest and 1 upright at rest; 0 without a twin.
  double energy() const;

 private:
  static constexpr int kAngle = 0, kVelocity = 2, kZero = 4, kFriction = 6, kOffset = 8,
                       kStates = 10;
  using Vector = Eigen::Matrix<double, kStates, 1>;
  using Matrix = Eigen::Matrix<double, kStates, kStates>;

  struct Model {
    Body body;
    Drive drive;
    Drive silent;     // the drive's torques until the response began
    Scale scale;      // natural units of the twin over those of UsualPlant
    bool has_offset;  // whether an offset of the torques is uncertain
    double horizon;   // from sending a torque to its effect, s
    double hanging;   // energy below upright of the links that hang, J
  };
  /// An estimate that follows the motion.
  struct Track {
    Vector x = Vector::Zero();
    Matrix P = Matrix::Zero();  // covariance of x
    double time = 0;            // s
  };
  /// Which encoders correct a track.
  using Encoders = std::array<bool, 2>;

  /// x after `seconds` of the twin's motion from x at `begin` (s).
  Vector Follow(const Drive& drive, Vector x, double begin, double seconds) const;
  /// Takes a reading of finite angles. `driven`: whether torques were sent.
  void Take(const TimedReading& reading, bool driven);
  /// Standard deviation of measured angles, rad.
  double AngleNoise() const;
  /// A velocity (rad/s) and a time (s) by the scale of the twin.
  double Velocity(double usual) const { return usual * model_->scale.velocity(); }
  double Time(double usual) const { return usual * model_->scale.time; }
  /// The same, but at least as long: times that belong to the link, however small the machine is.
  double LinkTime(double usual) const { return std::max(usual, Time(usual)); }
  /// Time constant of the mean of the innovations, s.
  double InnovationTime() const;
  /// Noise of the velocities of a track, rad/s/√s.
  double VelocityNoise(bool disturbed) const;
  /// Begins with measured angles of a moment (s). Zeros and friction stay.
  void Begin(const Joints& angle, double moment);
  /// Lets a track follow the motion for `seconds`. `noise`: of the velocities, rad/s/√s.
  void Predict(Track& track, double seconds, double noise) const;
  /// Corrects a track with the angles of some encoders. `limit`: of the normalized innovations, in
  /// standard deviations. Returns the normalized innovations, 0 for other encoders.
  Eigen::Vector2d Correct(Track& track, const Joints& angle, const Encoders& encoders,
                          double limit) const;
  /// Whether static friction may hold both links.
  bool Slow(const Track& track) const;
  /// Notices a push by the normalized innovations, `seconds` after the last ones.
  void NoticePush(const Eigen::Vector2d& normalized, double seconds);
  /// Begins to expect motion of a joint (0 or 1) from its measured angle on.
  void BeginUnseen(int joint, double angle);
  /// Updates what the encoder of each joint has to show by the other one.
  void ExpectUnseen(const TimedReading& reading);
  /// Updates what the torques have to show since they began. `driven`: as for Take.
  void ExpectResponse(const TimedReading& reading, bool driven);

  MachineSensors sensors_;
  double period_, latency_;  // s
  Joints sent_{};            // last torques, N·m
  StateSource source_ = StateSource::kDifferences;
  VelocityEstimate velocity_;
  std::optional<Model> model_;
  std::optional<double> begin_;  // time of the last Begin, s
  Track track_;
  Eigen::Vector2d mean_innovation_ = Eigen::Vector2d::Zero();  // normalized, low-passed
  double disturbed_until_ = 0;                                 // s
  std::array<Track, 2> unseen_;                                // without the encoder of each joint
  Joints shown_{};           // angles at their last visible motion, rad
  Joints shown_friction_{};  // dry friction that was estimated then, N·m
  Joints unseen_begin_{};    // times at which `unseen_` began, s
  Joints unseen_angle_{};    // angles of `unseen_` then, as the encoders would show them, rad
  Vector driven_ = Vector::Zero(), coasting_ = Vector::Zero();
  Joints response_angle_{};                        // measured when the torques began, rad
  double response_begin_ = 0, response_time_ = 0;  // s
  Expectation expectation_;
  PendulumState now_, ahead_;
};

}  // namespace upswing::machine
