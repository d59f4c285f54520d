#pragma once

#include <span>
#include <vector>

#include "base/archive.h"
#include "base/options.h"
#include "pendulum/plant.h"

/// Sensor models: encoders of both joints, velocities computed from them, and latency.
///
/// Symbols: N counts per revolution, q̂ measured angle (rad), ŵ measured velocity (rad/s), T window
/// (s), τ time constant (s), L latency (s), z zero (rad).
namespace upswing {

inline constexpr double kLongestLatency = 0.1;  // s
inline constexpr double kLongestWindow = 0.1;   // s
inline constexpr double kSlowestFilter = 1;     // s
inline constexpr double kLargestZero = 1;       // rad
/// Time between two updates of the velocity filter (s), as in a motor drive at 1 kHz; a control
/// period has a whole number of updates.
inline constexpr double kFilterPeriod = 0.001;

/// The sensors of one environment; zeros: exact angles and velocities without latency.
struct SensorModel {
  double latency = 0;           // L, age of the measured angles and velocities, s
  double encoder_counts = 0;    // N, of each joint; 0: exact angles
  double velocity_window = 0;   // T of ŵ(t) = (q̂(t) - q̂(t - T)) / T; 0: the true velocity, s
  double velocity_filter = 0;   // τ of the low-pass τ dy/dt = ŵ - y; 0: none, s
  double zero1 = 0, zero2 = 0;  // z of q̂ = q + z of each joint, rad

  /// Declares each setting in `options`: name, range, unit, help.
  void Describe(Options& options);

  bool exact() const {
    return latency == 0 && encoder_counts == 0 && velocity_window == 0 && velocity_filter == 0 &&
           zero1 == 0 && zero2 == 0;
  }
  /// Step of a measured angle, 2π/N, rad; 0: exact angles.
  double encoder_step() const;
  /// Mean age of the measured velocities, L + T/2 + τ, s.
  double velocity_age() const { return latency + velocity_window / 2 + velocity_filter; }
  /// Standard deviation (rad/s) that rounding adds to the change between two measured velocities.
  /// Four angles enter it, each with an error of a count over √12.
  double velocity_noise() const;
};

/// Measurements of a control step.
struct Measurement {
  PendulumState state;
  double torque = 0;  // N·m, mean over the control period in which the measured velocities changed
  double velocity_noise = 0;  // standard deviation of the error that the sensors add to this change
};

/// The nearest multiple of `step`, as a digital sensor shows a number; 0: the number itself.
double Quantized(double number, double step);

/// The sensors of N environments. They keep the states of the last control steps. Between two steps
/// they take the motion as the cubic that matches angles and velocities (StateBetween). In a
/// swing-up, the cubic differs from the physics' own steps by 3e-7 rad in the median and 1e-4 rad
/// at most. It works with every physics, timestep, window and latency.
class Sensors {
 public:
  /// Measures after each control period (s). No environment may have a larger latency, window or
  /// time constant than `slowest`.
  Sensors(int num_envs, double control_period, const SensorModel& slowest);

  /// Begins an episode in this state. Before the start, the joints count as moving at its
  /// velocities.
  void Begin(int env, const PendulumState& start);

  /// Takes the true state at a control step and the torque (N·m) of the control period before it, 0
  /// at the start. Returns the state that the sensors measure.
  PendulumState Measure(int env, const SensorModel& model, const PendulumState& now, double torque);

  /// The mean torque (N·m) over the control period in which the last measured velocities changed.
  /// Like the velocities, this torque is velocity_age() old.
  double Torque(int env, const SensorModel& model) const;

  void State(const Archive& archive);

 private:
  std::span<double> Past(int env) {
    return std::span(past_).subspan(static_cast<size_t>(env) * 4 * moments_, 4 * moments_);
  }
  std::span<double> Torques(int env) {
    return std::span(torques_).subspan(static_cast<size_t>(env) * moments_, moments_);
  }
  std::span<double> Filtered(int env) {
    return std::span(filtered_).subspan(static_cast<size_t>(env) * 2, 2);
  }

  /// The true state `age` seconds before the latest of these control steps (M × 4).
  PendulumState StateAgo(std::span<const double> past, double age) const;
  /// The encoder readings of that state.
  PendulumState Reading(std::span<const double> past, const SensorModel& model, double age) const;

  double period_;                 // s, between two control steps
  int filter_updates_;            // per control period
  size_t moments_;                // M, number of kept control steps
  std::vector<double> past_;      // (N × M × 4) true states q1, q2, w1, w2, latest first
  std::vector<double> torques_;   // (N × M) of the control periods before these states, N·m
  std::vector<double> filtered_;  // (N × 2) y of both joints, rad/s
};

}  // namespace upswing
