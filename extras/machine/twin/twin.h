#pragma once

#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "base/options.h"
#include "base/rng.h"
#include "extras/machine/logs/log.h"
#include "extras/machine/twin/cogging.h"
#include "pendulum/plant.h"
#include "pendulum/scale.h"

/// The twin: a model of a real machine with motors, sensors and control loop, identified from the
/// machine's logs.
namespace upswing::machine {

/// The motors. A torque follows its command after a delay, with a first-order lag:
///   lag · dτ/dt = command(t - delay) - τ
/// The links get τ + torque_offset. A drive that measures its current with an offset does not know
/// of it: the torque that it reports is τ - current_inertia · q̈, current_delay old. The motor's
/// induced voltage disturbs the current in proportion to the acceleration.
struct Actuator {
  // From reading the angles to the response of the torque sent with them, s. Negative: the torque
  // acts before the reading.
  double delay = 0;
  double lag = 0;              // time constant, s
  double passive_limit = 0;    // torque limit of the joint that is not actuated, N·m
  double current_delay = 0;    // time from the reported torque to the angles' reading, s
  double current_inertia = 0;  // kg·m²
  double torque_offset1 = 0, torque_offset2 = 0;  // added to a motor's torque, N·m

  bool has_offset() const { return torque_offset1 != 0 || torque_offset2 != 0; }
  /// Declares each setting in `options`: name, range, unit, help.
  void Describe(Options& options);
};

/// Whether a value is one of the offsets of the motors' torques.
bool IsTorqueOffset(std::string_view name);

/// Encoders, and the velocities that the control loop computes from their angles.
struct MachineSensors {
  double quantum = 0;             // step of a measured angle, rad
  double angle_range = 1000;      // largest measured angle, rad
  double torque_quantum = 0;      // step of a reported torque, N·m
  double zero1 = 0, zero2 = 0;    // measured angle of a joint that hangs, rad
  double velocity_share = 1;      // share of the newest finite difference in the low-pass
  double velocity_dead_zone = 0;  // slower velocities count as 0, rad/s

  /// Declares each setting in `options`: name, range, unit, help.
  void Describe(Options& options);
};

/// Timing of the control loop. A cycle sends the torque that the cycle before it computed, and
/// reads the angles.
struct LoopTiming {
  double period = 0.002;  // median time between two cycles, s
  double jitter = 0;      // standard deviation of a period, s
  double late_share = 0;  // share of the cycles that are late
  double late = 0;        // largest lateness of these, s

  /// Declares each setting in `options`: name, range, unit, help.
  void Describe(Options& options);
};

/// A session: logs between which the machine was not touched. The encoders are set to zero while
/// the links hang, and dry friction holds the links a little off. Dry friction itself changes with
/// temperature and wear, and screws or cables move.
struct Session {
  /// A setting of the twin, and its value in this session.
  struct Value {
    std::string setting;
    double number = 0;
  };
  std::string name;
  std::vector<Value> values;
};

/// The session of a log: its path from two folders above, without the last number of the file's
/// name and without its ending. Files that differ only in that number are of one session.
std::string SessionOf(const std::string& log);

/// A machine's model, and how certain its values are.
struct Twin {
  std::string name = "twin";
  std::string distrust;  // why the twin is not to be trusted, in one line; empty: it is
  Plant plant;
  Actuator actuator;
  Cogging cogging;
  MachineSensors sensors;
  LoopTiming loop;
  std::vector<std::string> uncertain;  // (n) names of the values with a covariance
  std::vector<double> covariance;      // (n × n)
  std::vector<Session> sessions;       // of the logs that the twin was identified from

  /// Declares each setting in `options`: name, range, unit, help.
  void Describe(Options& options);
};

/// RealAIGym's machine of design C.1, about as large as the machines on which this program's priors
/// of a fit and thresholds of the control loop are tuned.
Plant UsualPlant();
/// The natural units of a plant over those of UsualPlant; exactly 1 unless it has another size
/// (CarryOver). Priors and thresholds in s, rad/s and N·m are multiples of them.
Scale ScaleOverUsual(const Plant& plant);

/// The covariance of two values, by name; 0 if the twin has none.
double CovarianceOf(const Twin& twin, std::string_view a, std::string_view b);

/// The machine in a log's session, whose values are known; the twin itself if the log is of another
/// session.
Twin InSession(const Twin& twin, const MachineLog& log);

/// Reads a twin from a TOML document. `where` names it in messages. Values that the document leaves
/// out have their defaults; a twin without a name has an empty one. Throws BadInput if there is no
/// table [plant], for an unknown setting, for a value outside its range, and for a covariance that
/// is not symmetric and positive.
Twin ParseTwin(std::string_view text, const std::string& where);

/// Reads a twin from a plant file, or the shipped plant called `name`. A twin without a name gets
/// the file's. Messages name the argument `flag`, and what else it takes. Throws BadInput.
Twin ReadTwin(const std::string& name, const std::string& flag, const std::string& else_taken = "");

/// The twin as a TOML document that ParseTwin reads. It is a plant file too (runs/plant_file.h),
/// whose table [disturbance] has the sensors of the control loop as Disturbance describes them.
std::string TwinText(const Twin& twin);

/// A machine drawn from the twin's posterior: a normal distribution with its covariance. Values
/// beyond their range are cut at it.
Twin DrawTwin(const Twin& twin, Rng& rng);

/// The joint that a log's controller drives, 1 or 2; 0: both, or no motor. In the logs of an
/// acrobot or pendubot, the motor of the other joint only compensates friction.
int ActuatedJoint(const MachineLog& log, const Twin& twin);

/// The motors' torque limits (N·m) under a controller of this joint, as ActuatedJoint counts them.
Joints TorqueLimits(const Twin& twin, int actuated_joint);

}  // namespace upswing::machine
