#pragma once

#include <cstdint>
#include <limits>
#include <numbers>
#include <optional>
#include <vector>

#include "base/rng.h"
#include "extras/machine/logs/log.h"
#include "extras/realaigym/plant.h"

/// The rules of RealAIGym's boards of ICRA 2025, score version 3 (docs/howto/realaigym.md). A run
/// lasts 60 s. At random times both motors drive the pendulum to a random pose, then the controller
/// returns. The score is the share of the time in which the tip is high.
namespace upswing::realaigym {

inline constexpr double kUptimeSeconds = 60;

/// The resets of a run, which a PID of both joints makes. The defaults are those of the simulation.
struct ResetRules {
  int count = 15;
  double seconds = 0.2;
  double kp = 10, ki = 0.1, kd = 1;  // N·m/rad, N·m/(rad s), N·m·s/rad
  // Largest proportional torque, N·m.
  double most_proportional = std::numeric_limits<double>::infinity();
  // Largest angle (rad) and velocity (rad/s) of both joints. Beyond, another reset begins.
  double most_angle = std::numeric_limits<double>::infinity();
  double most_velocity = std::numeric_limits<double>::infinity();
};
/// The resets of the hardware boards.
inline constexpr ResetRules kHardwareResets{10, 1, 2, 0, 0.3, 3, 3.5 * std::numbers::pi, 20};

/// The resets of one run: the benchmark's GlobalPolicyTestingControllerV2.
class Resets {
 public:
  /// Draws times and poses.
  Resets(const ResetRules& rules, uint64_t seed);

  /// The torques (N·m) of both motors at a time (s), while a reset lasts; nothing at other times.
  /// Each call is a step of kBoardTimestep.
  std::optional<Joints> Torque(double time, const PendulumState& measured);

 private:
  void Begin(double time, bool violated);
  Joints Pid(const PendulumState& measured);

  ResetRules rules_;
  Rng rng_;
  std::vector<double> times_;  // s, ascending; the last is infinite
  size_t next_ = 0;            // reset in times_
  bool active_ = false;
  int steps_ = 0;                          // of the running reset
  int since_violation_ = 1'000'000;        // steps
  int errors_ = 0;                         // of the PID so far, which all resets share
  Joints goal_{}, error_{}, error_sum_{};  // rad
};

/// Whether the tip is above 90% of the links' length.
bool AboveLine(const Joints& angle);

/// A run's outcome.
struct UptimeRun {
  double score = 0;   // share of the 60 s with the tip above the line
  int swing_ups = 0;  // crossings of the line upwards, more than 1 s after the one before
};

/// The outcome of a run's log.
UptimeRun UptimeOf(const MachineLog& log);

}  // namespace upswing::realaigym
