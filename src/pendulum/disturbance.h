#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "base/archive.h"
#include "base/options.h"
#include "base/rng.h"
#include "pendulum/plant.h"
#include "pendulum/sensors.h"

namespace upswing {

inline constexpr double kLargestDelay = 1;  // s

/// Sensor noise, motor delay, late control steps and sensor model of one environment; zeros: no
/// disturbance.
///
/// The delay belongs to the motor: a torque acts `delay` after the controller chooses it. Until the
/// first chosen torque acts, the torque is zero. The sensors' latency is the age of the measured
/// state.
///
/// A late control step keeps the torque before it, as do the following ones for up to `late`: the
/// loop's computer does not answer in time. Such steps are the sticky actions of Machado et al.
/// (2018), with a length in s.
struct Disturbance {
  double sensor_noise = 0;  // standard deviation on each measured angle and velocity, rad, rad/s
  double delay = 0;         // from choosing a torque to its effect, s, in whole control periods
  SensorModel sensors = {};
  double late_share = 0;  // probability that a control step begins a lateness
  double late = 0;        // longest lateness, s

  /// Declares each setting in `options`: name, range, unit, help.
  /// Delays are multiples of `delay_step` (s); 0: any.
  void Describe(Options& options, double delay_step = 0);

  bool any() const { return sensor_noise > 0 || delay > 0 || is_late() || !sensors.exact(); }
  bool is_late() const { return late_share > 0 && late > 0; }
  /// The delay in control periods (s).
  int delay_steps(double control_period) const;
};

/// For each setting, the larger of its two values, or of their amounts.
Disturbance Larger(const Disturbance& a, const Disturbance& b);

/// The sensors of N environments: sensor models and noise.
class NoisySensors {
 public:
  /// Measures after each control period (s). No environment may have a larger latency, window or
  /// time constant than `slowest`. Environment i draws its noise from (seed, stream, first_index +
  /// i).
  NoisySensors(int num_envs, double control_period, const SensorModel& slowest, uint64_t seed,
               const std::string& stream, uint64_t first_index = 0);

  /// Sets the stream from which an environment draws its noise.
  void Seed(int env, const Rng& rng) { rngs_[static_cast<size_t>(env)] = rng; }
  /// Begins an episode in a state.
  void Begin(int env, const PendulumState& start);
  /// Takes the true state at a control step and the torque (N·m) of the control period before it, 0
  /// at the start. Returns what the sensors measure, with noise.
  Measurement Measure(int env, const Disturbance& disturbance, const PendulumState& state,
                      double torque);

  /// Saves or loads the sensors' memories and the streams.
  void State(const Archive& archive);

 private:
  std::optional<Sensors> sensors_;  // empty if all sensor models are exact
  std::vector<Rng> rngs_;           // (N)
};

}  // namespace upswing
