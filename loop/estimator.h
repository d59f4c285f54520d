#pragma once

#include <optional>

#include "loop/link.h"
#include "machine/motion.h"
#include "machine/simulated_machine.h"
#include "machine/twin.h"
#include "sim/double_pendulum.h"

/// Estimates of a machine's state from the angles that its encoders report.
namespace upswing {

/// Estimates the state in each cycle. A cycle sends the torques of the cycle before and reads the
/// angles at the same time.
///
/// Without a twin, velocities are low-passed differences of the angles (VelocityEstimate). With a
/// twin, an observer follows the twin's motion under the sent torques, and the measured angles
/// correct it:
///   q += α (measured - q),   w += β (measured - q) / h
/// Its prediction bridges lost readings. The controller gets the state at the time when its torque
/// will act: a cycle, the motors' delay and their lag later.
///
/// No function allocates memory after the constructor.
class Estimator {
 public:
  /// `sensors`: low-pass and dead zone; used without a twin. `period`: of the cycles, s.
  Estimator(const MachineSensors& sensors, double period);
  Estimator(const Twin& twin, double period);

  /// Takes the torques (N·m) sent at a time (s), and a new reading if there is one.
  void Update(double time, const Joints& sent, const LinkReading* reading);

  /// The estimated state now: true angles, without the encoders' zeros.
  const PendulumState& now() const { return now_; }
  /// The estimated state when a torque that is computed now will act.
  const PendulumState& ahead() const { return ahead_; }
  /// Mechanical energy now, 0 hanging at rest and 1 upright at rest; 0 without a twin.
  double energy() const;

 private:
  struct Model {
    Manipulator body;
    Drive drive;
    double age;      // of the readings, s
    double horizon;  // from sending a torque to its effect, s
    double hanging;  // energy below upright of the links that hang, J
  };
  /// The state after `seconds` of the twin's motion from a state at `begin` (s).
  PendulumState Follow(PendulumState state, double begin, double seconds) const;

  /// Corrects the observer with measured angles of a moment (s); velocities there are 0.
  void Correct(const PendulumState& seen, double moment);

  MachineSensors sensors_;
  double period_;
  VelocityEstimate velocity_;
  std::optional<Model> model_;
  bool begun_ = false;
  double time_ = 0;  // of observed_, s
  PendulumState observed_, now_, ahead_;
};

}  // namespace upswing
