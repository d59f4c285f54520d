#pragma once

#include <cstdint>
#include <deque>
#include <functional>

#include "base/rng.h"
#include "extras/machine/logs/log.h"
#include "extras/machine/twin/motion.h"
#include "extras/machine/twin/twin.h"

/// The machine that a twin describes: motors, links, encoders and control loop, in time.
namespace upswing::machine {

/// What the encoders and drives report.
struct MachineReading {
  Joints angle;   // rad
  Joints torque;  // N·m
};

/// A reading and the time at which the machine took it (s): when it got the answered command.
struct TimedReading : MachineReading {
  double time = 0;
};

/// Motors, links and encoders. Time is that of the encoders: the angles of a reading are those of
/// its moment. With a negative delay a torque acts before the moment in which it is sent.
class SimulatedMachine {
 public:
  /// Begins at time 0 in a state, whose angles are true ones, without torque. Throws BadInput if
  /// steps of kShortestMotionStep are unstable for the twin.
  SimulatedMachine(const Twin& twin, const PendulumState& start);

  /// Lets time pass until `time`, s.
  void Advance(double time);
  /// Sends torques (N·m) now. The motors hold them until the next ones.
  void Command(const Joints& torque);
  /// Leads the links to a state at once, as a hand or a stand would.
  void Place(const PendulumState& state);
  /// Reads encoders and drives now. A loop reads after it sent its torques, because torques with a
  /// negative delay have an effect on the reading.
  MachineReading Read() const;

  double time() const { return moments_.back().time; }
  /// The true state now.
  const PendulumState& state() const { return moments_.back().state; }

 private:
  /// The moment `age` seconds ago, by interpolation. Negative: ahead, under the torques sent so
  /// far.
  MotionPoint Ago(double age) const;

  Twin twin_;
  Body body_;
  Drive drive_;
  // The newest last; as long as reported torques are old and torques act back.
  std::deque<MotionPoint> moments_;
};

/// The velocities (rad/s) that the control loop computes from measured angles: finite differences,
/// low-passed.
class VelocityEstimate {
 public:
  explicit VelocityEstimate(const MachineSensors& sensors) : sensors_(sensors) {}
  /// Takes the angles (rad) read at a time (s).
  Joints Update(double time, const Joints& angle);

 private:
  MachineSensors sensors_;
  bool first_ = true;
  double time_ = 0;
  Joints angle_{}, velocity_{};
};

/// What a controller sees in a cycle.
struct CycleInput {
  double time;      // s
  Joints angle;     // rad
  Joints velocity;  // of VelocityEstimate, rad/s
};

/// Computes the torques (N·m) of both joints.
using CycleController = std::function<Joints(const CycleInput&)>;

/// A closed loop on a simulated machine.
struct LoopRun {
  double seconds = 10;
  PendulumState start = {};                 // true angles
  std::function<Joints(double)> push = {};  // torques (N·m) added at a time (s); empty: none
  // The loop stops at largest_angle (rad) and beyond largest_velocity (rad/s).
  double largest_angle = 1e9, largest_velocity = 1e9;
  int actuated_joint = 0;  // the other motor is limited to passive_limit; 0: both are alike
  uint64_t seed = 0;       // of the cycles' periods
};

/// Runs a controller on the twin's machine in the twin's loop, and returns the log. A cycle sends
/// the torques of the cycle before and then reads the angles.
MachineLog RunLoop(const Twin& twin, const LoopRun& run, const CycleController& controller);

}  // namespace upswing::machine
