#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "core/archive.h"
#include "core/options.h"
#include "core/rng.h"
#include "sim/double_pendulum.h"
#include "sim/sensors.h"

namespace upswing {

inline constexpr double kLargestDelay = 1;  // s

/// Sensor noise, motor delay and sensors of one environment; zeros: none.
///
/// The delay belongs to the motor: a torque acts `delay` after its choice; before the first one,
/// the torque is zero. The sensors' latency is the age of the measured state.
struct Disturbance {
  double sensor_noise = 0;  // standard deviation, on each measured angle and velocity, rad, rad/s
  double delay = 0;  // from the choice of a torque to its effect, s, in whole control periods
  SensorModel sensors = {};

  /// One line per setting: name, range, unit, help.
  void Describe(Options& options);

  bool any() const { return sensor_noise > 0 || delay > 0 || !sensors.exact(); }
  /// The delay in control periods.
  int delay_steps() const;
};

/// The larger value of each setting.
Disturbance Larger(const Disturbance& a, const Disturbance& b);

/// The sensors and motors of N environments.
class Disturber {
 public:
  /// For environments with one of `disturbances` for all or one for each, none of which will have a
  /// larger value of any setting than `largest`. Environment i draws its noise from (seed, stream,
  /// first_index + i).
  Disturber(std::vector<Disturbance> disturbances, int num_envs, const Disturbance& largest,
            uint64_t seed, const std::string& stream, uint64_t first_index = 0);

  /// Begins an episode in a state: no torque is waiting.
  void Begin(int env, const PendulumState& start);
  /// Sets another disturbance, in effect from the next episode on.
  void Set(int env, const Disturbance& disturbance) {
    disturbances_[static_cast<size_t>(env)] = disturbance;
  }

  /// Lets an environment draw its noise from this stream from now on.
  void Seed(int env, const Rng& rng) { rngs_[static_cast<size_t>(env)] = rng; }

  const Disturbance& disturbance(int env) const { return disturbances_[static_cast<size_t>(env)]; }

  /// Takes the torques (N), N·m, chosen at step `steps[i]` of each episode (N), counted from 0, and
  /// returns those that the motors apply now (N).
  std::span<const double> Apply(std::span<const double> torque, std::span<const int64_t> steps);

  /// Undoes the effect of Apply on an environment at this step of its episode.
  void Undo(int env, int64_t step);

  /// Takes the true state at a control step and the torque (N·m) that acted in the control period
  /// before it, 0 at the start, and returns what the sensors measure, with noise.
  PendulumState Measure(int env, PendulumState state, double torque);

  /// The mean torque (N·m) over the control period in which the last measured velocities changed;
  /// `torque` acted in the last control period.
  double MeasuredTorque(int env, double torque) const;

  /// Saves or loads the state; the disturbances themselves are not part of it.
  void State(const Archive& archive);

 private:
  std::span<double> Queue(int env) {
    return std::span(queues_).subspan(static_cast<size_t>(env) * capacity_, capacity_);
  }

  size_t capacity_;                        // the largest delay, control periods
  std::vector<Disturbance> disturbances_;  // (N)
  std::vector<double> queues_;             // (N × capacity) torques that wait, N·m
  std::vector<double> applied_;            // (N) N·m
  std::optional<Sensors> sensors_;         // none if all are exact
  std::vector<Rng> rngs_;                  // (N)
};

}  // namespace upswing
