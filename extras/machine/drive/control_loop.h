#pragma once

#include <concepts>
#include <cstdint>
#include <functional>
#include <utility>

#include "extras/machine/drive/estimator.h"
#include "extras/machine/drive/link.h"
#include "extras/machine/drive/supervisor.h"
#include "extras/machine/logs/log_writer.h"
#include "pendulum/task.h"

/// The control loop on a machine.
namespace upswing::machine {

/// A controller of one machine: the motor's torque (N·m) in a step of its period (s), from the
/// state. Steps count from 0, and can be left out.
class MachineController {
 public:
  using Law = std::function<double(int64_t step, const PendulumState& state)>;

  template <std::convertible_to<Law> F>
  MachineController(F law, double period = kControlPeriod)  // NOLINT: a law is a controller
      : law_(std::move(law)), period_(period) {}

  double operator()(int64_t step, const PendulumState& state) const { return law_(step, state); }
  double period() const { return period_; }

 private:
  Law law_;
  double period_;  // s
};

/// Cycles of a loop with `hz` cycles per second in a control period (s), rounded to the nearest.
/// Throws BadInput if that changes the period by more than a tenth.
int64_t CyclesIn(double control_period, int64_t hz);

/// The controller at the rate of a loop: its steps are cycles, `hz` per second. It holds each
/// torque for the cycles of a step of the given one. Throws as CyclesIn does.
MachineController PerCycle(MachineController controller, int64_t hz);

struct LoopConfig {
  int64_t hz = 500;                 // cycles per second
  double seconds = 10;              // time in which the controller drives
  int actuated_joint = 1;           // the controller's motor, 1 or 2
  double compensation = 0;          // share of each joint's dry friction that motors compensate
  std::function<bool()> stop = {};  // asks for a stop, such as by a signal
};

/// Times and results of a loop.
struct LoopSummary {
  static constexpr double kOnTime = 0.0002;  // s

  int64_t cycles = 0;
  int64_t moving = 0;      // cycles in which the loop probed, drove or braked
  int64_t on_time = 0;     // cycles that began within kOnTime of their deadlines
  int64_t missed = 0;      // cycles that were left out because others took too long
  int64_t unanswered = 0;  // cycles without a new reading, once there were readings
  double latest = 0;       // largest lateness, s
  double longest_act = 0;  // longest time that the controller took, s
  double driven = 0;       // time in which the controller drove, s
  double upright = 0;      // time for which both links were inverted at its end, s
};

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
  const Joints& torque() const { return torque_; }

 private:
  /// The times of a cycle by the link's clock.
  struct CycleStart {
    double deadline;  // s
    double now;       // begin, s
    double late;      // begin after the deadline, s
  };
  /// Waits for the deadline and counts the missed cycles.
  CycleStart WaitForDeadline();
  /// After a pause of this process, the torques of the cycle before are too old to be sent. Then
  /// drops them and switches the motors off.
  void DropOldTorque(double now);
  /// Sends the torques of the cycle before, and gets the reading that answers them.
  std::optional<LinkReading> Exchange(const CycleStart& start);
  CycleFacts FactsOf(double now, const std::optional<LinkReading>& reading);
  /// Measures the controller's time and success, and returns its torques (N·m).
  Joints RunController(const CycleFacts& facts);
  Joints ControllerTorque();
  void LogReading(const LinkReading& reading, const PendulumState& state, double late);

  LoopConfig config_;
  MachineLink& link_;
  Estimator& estimator_;
  Supervisor& supervisor_;
  MachineController controller_;  // its steps are cycles
  LogWriter& log_;
  LoopSummary summary_;
  double period_;              // s
  int64_t cycle_ = 0;          // its deadline is cycle_ · period_
  int64_t running_cycle_ = 0;  // first one in which the controller drove, or 0
  double upright_since_ = -1;  // s; negative: not upright
  double last_reading_ = -1;   // time, s
  Joints torque_{};            // computed in the last cycle, N·m
  bool enabled_ = false;
};

}  // namespace upswing::machine
