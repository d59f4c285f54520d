#pragma once

#include <array>
#include <string>

#include "base/options.h"
#include "extras/machine/drive/earned_torque.h"
#include "extras/machine/drive/expectation.h"
#include "extras/machine/logs/log.h"
#include "extras/machine/twin/twin.h"
#include "pendulum/plant.h"
#include "pendulum/scale.h"

/// The supervisor of a control loop: it decides in each cycle who drives the motors. It has no
/// clock, no link and no thread of its own.
namespace upswing::machine {

/// Limits of a run on a machine. The defaults are for RealAIGym's robot.
struct Limits {
  double angle = 12;            // rad
  double velocity = 25;         // rad/s
  double torque = 5;            // N·m
  double energy = 4;            // 0: hanging at rest, 1: upright at rest
  double age = 0.02;            // of the last reading, s
  double brake_damping = 0.2;   // torque per velocity while braking, N·m·s/rad
  double brake_seconds = 5;     // longest time of braking, s
  double patience = 10;         // longest time until readings come, or the start is reached, s
  double passive_torque = 0.5;  // of the joint without the controller's motor, N·m

  /// The defaults for a machine like this twin. For another size (ScaleOverUsual) the torques are
  /// those of the twin's motors, and velocities and times count in natural units. The age of a
  /// reading is a matter of the link, so no size changes it.
  static Limits For(const Twin& twin);

  /// Declares each setting in `options`: name, range, unit, help.
  void Describe(Options& options);
};

enum class LoopState {
  kIdle,     // waits for readings; motors off
  kArmed,    // readings come; motors hold torque 0 until the machine is in its start state, and at
             // first until it rests
  kRunning,  // the controller drives
  kBraking,  // torques against the motion until the links hang; then kIdle, or kFault with a reason
  kFault,    // motors off until the program ends
  kProbing,  // short pulses of the motors, which the encoders have to answer; then kArmed
};
const char* NameOf(LoopState state);
/// Whether torques may act in a state.
bool MayDrive(LoopState state);

/// The supervisor's inputs in a cycle. All times are of the loop's clock.
struct CycleFacts {
  double time = 0;           // s
  bool fresh = false;        // whether a new reading came in this cycle
  double read_at = 0;        // when the new reading's command was sent, s
  double received = 0;       // when the new reading came, s; it was measured in between
  double age = 0;            // of the last reading, s
  Joints angle{}, torque{};  // of the new reading, rad and N·m; untrusted
  bool locked = false;       // whether the machine says that its motors are locked
  Joints zero{};             // estimate of the angles that the encoders show at 0, rad
  PendulumState state{};     // estimate of the true state now
  PendulumState ahead{};     // the same when a torque that is sent next will act
  double energy = 0;         // see Limits; 0 if unknown
  double period = 0.002;     // usual time between two cycles, s
  Expectation expected{};    // motion that the encoders have to show
  bool stop = false;         // whether the user or the end of the run asks for a stop
};

/// Usual distance from the start state at which the controller takes over, rad.
inline constexpr double kStartAngle = 0.3;

/// The settings of a supervisor.
struct SupervisorConfig {
  Limits limits;
  // Natural units of the machine over those of UsualPlant, in which thresholds of velocity,
  // acceleration and time count.
  Scale scale = {};
  // State in which the controller takes over, to within start_angle (rad) and kStartVelocity.
  PendulumState start = {};
  double start_angle = kStartAngle;
  Joints motor_limit{};    // largest torque of each joint, N·m
  int actuated_joint = 1;  // of the controller's motor, 1 or 2
  TwinTrust trust = TwinTrust::kAlways;
  double angle_range = 0;  // of the encoders, rad
  double quantum = 0;      // of the encoders, rad
};

/// The state machine. Faults are latched. For any inputs, torques are finite and within their
/// limits, and 0 after a fault.
class Supervisor {
 public:
  explicit Supervisor(const SupervisorConfig& config);

  /// Faults if the motors are on and the last reading is older (s) than the limit: the machine is
  /// silent, or this process was stopped. Returns whether there is no fault.
  bool CheckAge(double age);
  /// Takes a cycle's facts and returns the state in which the cycle's torques are chosen.
  LoopState Step(const CycleFacts& facts);
  /// The torques (N·m) to send: the controller's within the limits, torques against the motion, or
  /// 0. A torque that is not finite is a fault. Call it after Step with the same facts.
  Joints Torque(const Joints& controller, const CycleFacts& facts);

  LoopState state() const { return state_; }
  /// Whether the machine has been stopped: kFault, or kIdle after kRunning.
  bool ended() const { return state_ == LoopState::kFault || ended_; }
  /// Why the supervisor stops or has stopped the run, in one line; empty: no fault.
  const std::string& reason() const { return reason_; }
  /// Whether the reason is a fault, not a limit of the run that was exceeded.
  bool faulty() const { return !reason_.empty() && !beyond_limit_; }
  /// Number of cycles in which a torque was clipped.
  int64_t clipped() const { return clipped_; }

  // Velocity relative to the start state at which the controller takes over, rad/s by scale.
  static constexpr double kStartVelocity = 0.5;
  static constexpr int kArmReadings = 5;  // readings in a row before the motors are armed

 private:
  /// Sets the reason, unless there is one.
  void Report(const Complaint& complaint);
  /// Reports a complaint and switches the motors off.
  void Fail(const Complaint& complaint);
  void Brake(const CycleFacts& facts);
  Complaint CheckReading(const CycleFacts& facts);
  Complaint CheckMotion(const CycleFacts& facts);
  Complaint CheckEstimate(const CycleFacts& facts) const;
  Complaint CheckSlip(const CycleFacts& facts) const;
  Complaint CheckResponse();
  Complaint CheckLimits(const CycleFacts& facts) const;
  void GoOnBraking(const CycleFacts& facts);
  Joints BrakeTorque(const CycleFacts& facts) const;
  /// A velocity (rad/s), an acceleration (rad/s²) and a time (s) by the scale of the machine.
  double Velocity(double usual) const { return usual * config_.scale.velocity(); }
  double Acceleration(double usual) const { return Velocity(usual) / config_.scale.time; }
  double Time(double usual) const { return usual * config_.scale.time; }
  bool AtRest(const PendulumState& s) const;
  bool AtStart(const PendulumState& s) const;
  void Wait(const CycleFacts& facts);
  /// Checks and ends a cycle in which torques may act.
  void Drive(const CycleFacts& facts);

  SupervisorConfig config_;
  LoopState state_ = LoopState::kIdle;
  bool ended_ = false, begun_ = false;
  bool beyond_limit_ = false;  // whether the reason is a limit
  std::string reason_;
  int readings_ = 0;                      // in a row
  bool unlocks_ = false;                  // whether the machine locked its motors when armed
  double since_ = 0, slow_since_ = 0;     // s
  double energy_ = 0, least_energy_ = 0;  // smoothed while braking; see Limits
  int64_t clipped_ = 0;

  /// The readings of a joint.
  struct Joint {
    double angle = 0;                 // last reading, rad
    double rate = 0;                  // last change over the time between the commands, rad/s
    double slowest = 0, fastest = 0;  // velocities that the readings permit, rad/s
    double step;                      // of the encoder, rad
    int repeats = 0;                  // readings since the angle changed
    double changed_at = 0;            // when the last change was received, s
    double least_speed = 0;           // after it, rad/s
  };
  bool CheckVelocity(Joint& joint, double change, double shortest, double longest) const;
  bool IsStuck(Joint& joint, double change, double longest, const CycleFacts& facts) const;

  std::array<Joint, 2> joints_;
  EarnedTorque earned_;
  Joints torque_{};  // of the last cycle, N·m
  bool has_reading_ = false;
  double last_read_at_ = 0, last_received_ = 0;  // s
};

/// Parses a start state: hanging, upright, or q1,q2,w1,w2 (rad, rad/s). Throws BadInput that begins
/// with `where`.
PendulumState ParsePendulumStart(const std::string& text, const std::string& where = "--start");

}  // namespace upswing::machine
