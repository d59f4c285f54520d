#pragma once

#include <cstdint>
#include <functional>
#include <optional>

#include "extras/machine/drive/estimator.h"
#include "extras/machine/drive/link.h"
#include "extras/machine/drive/machine_controller.h"
#include "extras/machine/drive/supervisor.h"

/// The decisions of a control loop, without its link and its clock.
namespace upswing::machine {

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

/// The times of a cycle for its decisions.
struct CycleTimes {
  int64_t number = 0;     // of its deadline, in cycles of LoopConfig::hz
  double now = 0;         // when it begins, s
  double period = 0.002;  // usual time between two cycles, s
};

/// Estimates the state, asks the supervisor, and computes torques, cycle by cycle.
class LoopCore {
 public:
  /// The steps of `controller` are cycles of `config.hz`. Writes results to `summary`. The
  /// references must outlive the core.
  LoopCore(const LoopConfig& config, Estimator& estimator, Supervisor& supervisor,
           MachineController controller, LoopSummary& summary);

  /// Drops the torques and switches the motors off if at a time (s) the last reading is older than
  /// the limit and `usual` (s) together.
  void CheckAge(double now, double usual);
  /// Decides the torques of a cycle, after the last ones were sent. Throws as the controller does.
  void Decide(const CycleTimes& cycle, const std::optional<LinkReading>& reading);

  /// The torques to send, N·m.
  const Joints& torque() const { return torque_; }
  /// Whether the motors may be on.
  bool enabled() const { return enabled_; }

 private:
  CycleFacts FactsOf(const CycleTimes& cycle, const std::optional<LinkReading>& reading);
  /// Measures the controller's time and success, and returns its torques (N·m).
  Joints RunController(const CycleTimes& cycle, const CycleFacts& facts);
  Joints ControllerTorque(const CycleTimes& cycle);

  LoopConfig config_;
  Estimator& estimator_;
  Supervisor& supervisor_;
  MachineController controller_;
  LoopSummary& summary_;
  double tick_;                // time between the deadlines of two cycles, s
  int64_t running_cycle_ = 0;  // first one in which the controller drove, or 0
  double upright_since_ = -1;  // s; negative: not upright
  double last_reading_ = -1;   // time, s; negative: none
  Joints torque_{};            // N·m
  bool enabled_ = false;
};

}  // namespace upswing::machine
