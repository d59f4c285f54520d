// Symbols as in pendulum/sensors.h.
#include "pendulum/sensors.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>

#include "pendulum/control_period.h"

namespace upswing {

void SensorModel::Describe(Options& o) {
  o.Add(&latency, "sensor_latency", {0, kLongestLatency}, "s",
        "age of the measured angles and velocities");
  o.Add(&encoder_counts, "encoder_counts", {0, 1e9}, "1/revolution",
        "encoder counts per revolution, which round the measured angles; 0: exact angles");
  o.Add(&velocity_window, "velocity_window", {0, kLongestWindow}, "s",
        "time over which velocities are differences of measured angles; 0: true velocities");
  o.Add(&velocity_filter, "velocity_filter", {0, kSlowestFilter}, "s",
        "time constant of a first-order low-pass filter on measured velocities; 0: no filter");
  o.Add(&zero1, "zero1", {-kLargestZero, kLargestZero}, "rad",
        "measured angle of joint 1 that hangs");
  o.Add(&zero2, "zero2", {-kLargestZero, kLargestZero}, "rad",
        "measured angle of a straight joint 2");
}

double SensorModel::encoder_step() const {
  return encoder_counts == 0 ? 0 : 2 * std::numbers::pi / encoder_counts;
}

double SensorModel::velocity_noise() const {
  return velocity_window == 0 ? 0 : encoder_step() / velocity_window * std::sqrt(4.0 / 12);
}

double Quantized(double number, double step) {
  return step == 0 ? number : step * std::round(number / step);
}

Sensors::Sensors(int num_envs, double control_period, const SensorModel& slowest)
    : period_(control_period),
      filter_updates_(
          static_cast<int>(std::max<int64_t>(1, PeriodsIn(control_period, kFilterPeriod)))) {
  const double age = std::max(slowest.latency + slowest.velocity_window, slowest.velocity_age());
  // The oldest filter update of a step is less than one control period before the step.
  moments_ = static_cast<size_t>(std::ceil(age / period_)) + 2;
  past_.resize(static_cast<size_t>(num_envs) * 4 * moments_);
  torques_.resize(static_cast<size_t>(num_envs) * moments_);
  filtered_.resize(static_cast<size_t>(num_envs) * 2);
}

PendulumState Sensors::StateAgo(std::span<const double> past, double age) const {
  const auto at = [&](size_t k) {
    const auto s = past.subspan(4 * k, 4);
    return PendulumState{s[0], s[1], s[2], s[3]};
  };
  const double steps = age / period_;
  const auto k = static_cast<size_t>(steps);
  return StateBetween(at(k + 1), at(k), period_, 1 - (steps - static_cast<double>(k)));
}

PendulumState Sensors::Reading(std::span<const double> past, const SensorModel& model,
                               double age) const {
  const double step = model.encoder_step(), T = model.velocity_window;
  PendulumState s = StateAgo(past, age);
  s.q1 = Quantized(s.q1 + model.zero1, step);
  s.q2 = Quantized(s.q2 + model.zero2, step);
  if (T > 0) {
    const PendulumState before = StateAgo(past, age + T);
    s.w1 = (s.q1 - Quantized(before.q1 + model.zero1, step)) / T;
    s.w2 = (s.q2 - Quantized(before.q2 + model.zero2, step)) / T;
  }
  return s;
}

void Sensors::Begin(int env, const PendulumState& start) {
  const auto& [q1, q2, w1, w2] = start;
  // The first Measure puts the start state before these.
  const auto past = Past(env);
  for (size_t k = 0; k < moments_; ++k) {
    const double age = static_cast<double>(k + 1) * period_;
    std::ranges::copy(std::array{q1 - age * w1, q2 - age * w2, w1, w2}, past.begin() + 4 * k);
  }
  std::ranges::fill(Torques(env), 0.0);
  std::ranges::copy(std::array{w1, w2}, Filtered(env).begin());
}

PendulumState Sensors::Measure(int env, const SensorModel& model, const PendulumState& now,
                               double torque) {
  const auto past = Past(env);
  std::copy_backward(past.begin(), past.end() - 4, past.end());
  std::ranges::copy(std::array{now.q1, now.q2, now.w1, now.w2}, past.begin());
  const auto torques = Torques(env);
  std::copy_backward(torques.begin(), torques.end() - 1, torques.end());
  torques.front() = torque;

  PendulumState measured = Reading(past, model, model.latency);
  const auto y = Filtered(env);
  if (model.velocity_filter == 0) {
    std::ranges::copy(std::array{measured.w1, measured.w2}, y.begin());
    return measured;
  }
  // y is the filter's exact response to a ŵ that is constant between two updates.
  const double step = period_ / filter_updates_;
  const double share = 1 - std::exp(-step / model.velocity_filter);
  for (int update = filter_updates_ - 1; update >= 0; --update) {
    const PendulumState s = Reading(past, model, model.latency + update * step);
    y[0] += share * (s.w1 - y[0]);
    y[1] += share * (s.w2 - y[1]);
  }
  measured.w1 = y[0];
  measured.w2 = y[1];
  return measured;
}

double Sensors::Torque(int env, const SensorModel& model) const {
  const double steps = model.velocity_age() / period_;
  const auto k = static_cast<size_t>(steps);
  const double share = steps - static_cast<double>(k);
  const double* torque = torques_.data() + static_cast<size_t>(env) * moments_;
  return (1 - share) * torque[k] + share * torque[k + 1];
}

void Sensors::State(const Archive& archive) {
  archive.Array("past", std::span(past_));
  archive.Array("torques", std::span(torques_));
  archive.Array("filtered", std::span(filtered_));
}

}  // namespace upswing
