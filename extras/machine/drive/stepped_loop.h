#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>

#include "extras/machine/drive/estimator.h"
#include "extras/machine/drive/loop_core.h"
#include "extras/machine/drive/policy_controller.h"
#include "extras/machine/drive/supervisor.h"
#include "extras/machine/twin/twin.h"

/// A control loop whose cycles belong to the caller, such as the client of a machine in a cloud.
namespace upswing::machine {

/// The settings of a SteppedLoop.
struct SteppedLoopConfig {
  Limits limits;
  PendulumState start = {};  // state in which the controller takes over
  double compensation = 0;   // share of each joint's dry friction that motors compensate
  // From a reading to sending the torques that answer it, s. Nothing: they are sent with the next
  // reading, as ControlLoop does.
  std::optional<double> latency = 0;

  /// The defaults for a twin's machine: Limits::For, and readings that come up to kLongestGap
  /// apart.
  static SteppedLoopConfig For(const Twin& twin);
  static constexpr double kLongestGap = 0.1;  // s

  /// Declares limits and compensation in `options`: name, range, unit, help.
  void Describe(Options& options);
};

/// The estimator, the supervisor and the controller of ControlLoop, which the caller steps with a
/// reading at any times. The controller acts at the reading nearest to the end of its control period,
/// and its torque is held between.
class SteppedLoop {
 public:
  SteppedLoop(const MachinePolicy& policy, const Twin& twin, const SteppedLoopConfig& config);
  SteppedLoop(const SteppedLoop&) = delete;
  SteppedLoop& operator=(const SteppedLoop&) = delete;

  /// Takes the angles (rad) that the encoders show at a time (s) of the caller's clock. Returns the
  /// torques (N·m) to send now. At the time of the reading before, nothing changes. Throws BadInput
  /// for an earlier time and for numbers that are not finite, and as the controller does; the
  /// torques are 0 from then on.
  Joints Step(double time, const Joints& angle);
  /// Asks for a stop: the motors brake until the links hang.
  void Stop() { stop_asked_ = true; }
  /// Refuses all further readings with a reason: the torques are 0.
  void Refuse(const std::string& reason) {
    if (refused_.empty()) refused_ = reason;
  }

  LoopState state() const { return refused_.empty() ? supervisor_.state() : LoopState::kFault; }
  /// Why the controller no longer drives, in a line; empty until then. While the loop brakes,
  /// torques are not 0.
  std::string stopped() const;
  /// The estimated state at the last reading, without the encoders' zeros.
  const PendulumState& estimate() const { return estimator_.now(); }
  const LoopSummary& summary() const { return summary_; }
  const LoadedPolicy& policy() const { return *policy_; }

 private:
  void CheckReading(double time, const Joints& angle) const;
  /// The controller, whose steps are ticks: it acts once in its control period.
  MachineController PerTick();
  /// Updates the usual time between two readings by the last one, s: the median of the last ones,
  /// which a gap does not change.
  void LearnPeriod(double interval);
  void Cycle(double now, const Joints& angle);

  MachinePolicy policy_;
  std::optional<double> latency_;
  bool stop_asked_ = false;
  double period_ = 0;                   // usual time between two readings, s; 0: unknown
  std::array<double, 15> intervals_{};  // the last ones, in a ring, s
  size_t known_intervals_ = 0;
  bool begun_ = false;  // whether there was a reading
  double origin_ = 0;   // time 0 by the caller's clock, s
  double time_ = 0;     // of the last reading by the caller's clock, s
  std::string refused_;
  Estimator estimator_;
  Supervisor supervisor_;
  LoopSummary summary_;
  LoopCore core_;
};

}  // namespace upswing::machine
