#pragma once

#include <cstdint>
#include <optional>

#include "extras/machine/drive/link.h"
#include "extras/machine/drive/loop_core.h"
#include "extras/machine/logs/log_writer.h"

/// The control loop on a machine.
namespace upswing::machine {

/// Cycle by cycle: waits for the deadline, sends the torques of the cycle before, gets the reading
/// that answers them, estimates the state, asks the supervisor, and computes torques. Thus torques
/// leave at the deadlines, and computing time does not blur them.
class ControlLoop {
 public:
  /// The references must outlive the loop.
  ControlLoop(const LoopConfig& config, MachineLink& link, Estimator& estimator,
              Supervisor& supervisor, MachineController controller, LogWriter& log);

  /// Runs a cycle. Returns whether another one follows. Allocates no memory, unless the controller
  /// does.
  bool Cycle();
  /// Sends to the machine that its motors are off.
  void SwitchOff();
  /// Runs all cycles, then switches off.
  void Run();

  const LoopSummary& summary() const { return summary_; }
  /// The torques (N·m) of the last cycle, which the next one sends.
  const Joints& torque() const { return core_.torque(); }

 private:
  /// The times of a cycle by the link's clock.
  struct CycleStart {
    double deadline;  // s
    double now;       // begin, s
    double late;      // begin after the deadline, s
  };
  /// Waits for the deadline and counts the missed cycles.
  CycleStart WaitForDeadline();
  /// Sends the torques of the cycle before, and gets the reading that answers them.
  std::optional<LinkReading> Exchange(const CycleStart& start);
  void LogReading(const LinkReading& reading, double late);

  MachineLink& link_;
  Estimator& estimator_;
  Supervisor& supervisor_;
  LogWriter& log_;
  LoopSummary summary_;
  LoopCore core_;
  double period_;      // s
  int64_t cycle_ = 0;  // its deadline is cycle_ · period_
};

}  // namespace upswing::machine
