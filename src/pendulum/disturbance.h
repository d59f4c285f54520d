#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "base/archive.h"
#include "base/options.h"
#include "base/rng.h"
#include "pendulum/plant.h"
#include "pendulum/sensors.h"

namespace upswing {

inline constexpr double kLargestDelay = 1;  // s

/// Sensor noise, motor delay and sensor model of one environment; zeros: no disturbance.
///
/// The delay belongs to the motor: a torque acts `delay` after the controller chooses it. Until the
/// first chosen torque acts, the torque is zero. The sensors' latency is the age of the measured
/// state.
struct Disturbance {
  double sensor_noise = 0;  // standard deviation on each measured angle and velocity, rad, rad/s
  double delay = 0;         // from choosing a torque to its effect, s, in whole control periods
  SensorModel sensors = {};

  /// Declares each setting in `options`: name, range, unit, help.
  void Describe(Options& options);

  bool any() const { return sensor_noise > 0 || delay > 0 || !sensors.exact(); }
  /// The delay in control periods.
  int delay_steps() const;
};

/// For each setting, the larger of its two values.
Disturbance Larger(const Disturbance& a, const Disturbance& b);

/// The sensors and motors of N environments.
class Disturber {
 public:
  /// `disturbances` holds one for all environments or one for each. No later disturbance may have a
  /// setting above that of `largest`. Environment i draws its noise from (seed, stream, first_index
  /// + i).
  Disturber(std::vector<Disturbance> disturbances, int num_envs, const Disturbance& largest,
            uint64_t seed, const std::string& stream, uint64_t first_index = 0);

  /// Begins an episode in a state; no torque is waiting.
  void Begin(int env, const PendulumState& start);
  /// Sets a new disturbance, in effect from the next episode on.
  void Set(int env, const Disturbance& disturbance) {
    disturbances_[static_cast<size_t>(env)] = disturbance;
  }

  /// Sets the stream from which an environment draws its noise.
  void Seed(int env, const Rng& rng) { rngs_[static_cast<size_t>(env)] = rng; }

  const Disturbance& disturbance(int env) const { return disturbances_[static_cast<size_t>(env)]; }

  /// Queues the torques (N), N·m, chosen at step `steps[i]` of each episode (N), counted from 0.
  /// Returns the torques that the motors apply now (N), N·m.
  std::span<const double> Apply(std::span<const double> torque, std::span<const int64_t> steps);

  /// Undoes the effect of Apply on an environment at step `step` of its episode.
  void Undo(int env, int64_t step);

  /// Takes the true state at a control step and the torque (N·m) of the control period before it, 0
  /// at the start. Returns what the sensors measure, with noise.
  Measurement Measure(int env, const PendulumState& state, double torque);

  /// Saves or loads the state, but not the disturbances.
  void State(const Archive& archive);

 private:
  std::span<double> Queue(int env) {
    return std::span(queues_).subspan(static_cast<size_t>(env) * capacity_, capacity_);
  }

  size_t capacity_;                        // the largest delay, control periods
  std::vector<Disturbance> disturbances_;  // (N)
  std::vector<double> queues_;             // (N × capacity) waiting torques, N·m
  std::vector<double> applied_;            // (N) N·m
  std::optional<Sensors> sensors_;         // empty if all sensors are exact
  std::vector<Rng> rngs_;                  // (N)
};

}  // namespace upswing
