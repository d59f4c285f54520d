#pragma once

#include <array>
#include <string>

#include "core/options.h"
#include "machine/log.h"
#include "sim/double_pendulum.h"

/// The supervisor of a control loop: it decides in each cycle who drives the motors. It has no
/// clock, no link and no thread of its own.
namespace upswing {

/// Limits of a run on a machine.
struct Limits {
  double angle = 12;           // rad
  double velocity = 25;        // rad/s
  double torque = 5;           // N·m
  double energy = 4;           // 0: hanging at rest, 1: upright at rest
  double age = 0.02;           // of the last reading, s
  double brake_damping = 0.2;  // torque per velocity while braking, N·m·s/rad
  double brake_seconds = 5;    // longest time of braking, s
  double patience = 10;        // longest time until readings come, or the start is reached, s

  /// Declares each setting in `options`: name, range, unit, help.
  void Describe(Options& options);
};

enum class LoopState {
  kIdle,     // waits for readings; motors off
  kArmed,    // readings come; motors hold torque 0 until the machine is in its start state
  kRunning,  // the controller drives
  kBraking,  // damped torques until the machine is slow; then kIdle, or kFault if there is a reason
  kFault,    // motors off until the program ends
};
const char* NameOf(LoopState state);

/// What a cycle knows when the supervisor decides.
struct CycleFacts {
  double time = 0;           // s
  bool fresh = false;        // whether a new reading came in this cycle
  double read_at = 0;        // time of the new reading by the machine's clock, s
  double age = 0;            // of the last reading, s
  Joints angle{}, torque{};  // of the new reading, rad and N·m; untrusted
  bool locked = false;       // whether the machine says that its motors are locked
  PendulumState state{};     // estimate of the true state
  double energy = 0;         // see Limits; 0 if unknown
  bool stop = false;         // whether the user or the end of the run asks for a stop
};

/// The state machine. Faults are latched.
class Supervisor {
 public:
  /// `start`: state in which the controller takes over, to within kStartAngle and kStartVelocity.
  /// `motor_limit`: largest torque of each joint, N·m. `angle_range` (rad) and `quantum` (rad): of
  /// the encoders.
  Supervisor(const Limits& limits, const PendulumState& start, const Joints& motor_limit,
             double angle_range, double quantum);

  /// Takes a cycle's facts and returns the state in which the cycle's torques are chosen.
  LoopState Step(const CycleFacts& facts);
  /// The torques (N·m) to send: the controller's within the limits, damping, or 0. A torque that is
  /// not finite is a fault. Call it after Step with the same facts.
  Joints Torque(const Joints& controller, const CycleFacts& facts);

  LoopState state() const { return state_; }
  /// Whether the machine has been stopped: kFault, or kIdle after kRunning.
  bool ended() const { return state_ == LoopState::kFault || ended_; }
  /// Why the supervisor stops or has stopped the run, in one line; empty: no fault.
  const std::string& reason() const { return reason_; }
  /// Number of cycles in which a torque was clipped.
  int64_t clipped() const { return clipped_; }

  // Distance from the start state at which the controller takes over.
  static constexpr double kStartAngle = 0.3, kStartVelocity = 0.5;  // rad, rad/s
  static constexpr int kArmReadings = 5;  // readings in a row before the motors are armed

 private:
  /// Sets the reason from a format of two numbers, unless there is one.
  void Fault(const char* text, double first = 0, double second = 0);
  void Brake(const CycleFacts& facts);
  bool CheckReading(const CycleFacts& facts);
  bool IsStuck(const CycleFacts& facts);
  void CheckLimits(const CycleFacts& facts);
  bool AtStart(const PendulumState& s) const;
  void Wait(const CycleFacts& facts);

  Limits limits_;
  PendulumState start_;
  Joints motor_limit_;
  double angle_range_, quantum_;
  LoopState state_ = LoopState::kIdle;
  bool ended_ = false, begun_ = false;
  std::string reason_;
  int readings_ = 0;
  double since_ = 0, slow_since_ = 0;  // s
  int64_t clipped_ = 0;
  // The last readings, for stuck encoders.
  double last_time_ = 0;
  Joints last_angle_{};
  Joints speed_{};                // of the last change that was not 0, rad/s
  std::array<int, 2> repeats_{};  // readings without a change after it
};

/// Parses a start state: hanging, upright, or q1,q2,w1,w2 (rad, rad/s). Throws BadInput that begins
/// with --start.
PendulumState ParseStart(const std::string& text);

}  // namespace upswing
