#include "pendulum/disturbance.h"

#include <algorithm>
#include <cmath>

#include "base/text.h"
#include "pendulum/control_period.h"

namespace upswing {

void Disturbance::Describe(Options& o, double delay_step) {
  o.Section("disturbance");
  o.Add(&sensor_noise, "sensor_noise", {0, 10}, "rad, rad/s",
        "standard deviation of the noise on measured angles and velocities");
  o.Add(&delay, "delay", {0, kLargestDelay}, "s",
        "time from choosing a torque to its effect, in whole control periods")
      .step = delay_step;
  sensors.Describe(o);
  o.Add(&late_share, "late_share", {0, 1}, "",
        "probability that a control step is late: it and the next ones keep the torque before");
  o.Add(&late, "late", {0, kLargestDelay}, "s",
        "longest time for which a late control step keeps the torque before");
}

int Disturbance::delay_steps(double control_period) const {
  return static_cast<int>(PeriodsIn(delay, control_period));
}

Disturbance Larger(const Disturbance& a, const Disturbance& b) {
  const SensorModel &x = a.sensors, &y = b.sensors;
  return {std::max(a.sensor_noise, b.sensor_noise),
          std::max(a.delay, b.delay),
          {std::max(x.latency, y.latency), std::max(x.encoder_counts, y.encoder_counts),
           std::max(x.velocity_window, y.velocity_window),
           std::max(x.velocity_filter, y.velocity_filter),
           std::max(std::abs(x.zero1), std::abs(y.zero1)),
           std::max(std::abs(x.zero2), std::abs(y.zero2))},
          std::max(a.late_share, b.late_share),
          std::max(a.late, b.late)};
}

NoisySensors::NoisySensors(int num_envs, double control_period, const SensorModel& slowest,
                           uint64_t seed, const std::string& stream, uint64_t first_index) {
  if (!slowest.exact()) sensors_.emplace(num_envs, control_period, slowest);
  const auto n = static_cast<size_t>(num_envs);
  for (size_t i = 0; i < n; ++i) rngs_.emplace_back(seed, stream, first_index + i);
}

void NoisySensors::Begin(int env, const PendulumState& start) {
  if (sensors_) sensors_->Begin(env, start);
}

Measurement NoisySensors::Measure(int env, const Disturbance& disturbance,
                                  const PendulumState& state, double torque) {
  Measurement measured{state, torque};
  if (sensors_) {
    const SensorModel& model = disturbance.sensors;
    measured = {sensors_->Measure(env, model, state, torque), sensors_->Torque(env, model),
                model.velocity_noise()};
  }
  const double noise = disturbance.sensor_noise;
  if (noise == 0) return measured;
  Rng& rng = rngs_[static_cast<size_t>(env)];
  PendulumState& s = measured.state;
  for (double* x : {&s.q1, &s.q2, &s.w1, &s.w2}) *x += noise * rng.Normal();
  return measured;
}

void NoisySensors::State(const Archive& archive) {
  if (sensors_) sensors_->State(archive.In("sensors"));
  for (size_t i = 0; i < rngs_.size(); ++i) rngs_[i].State(archive.In(Concat("rng.", i)));
}

}  // namespace upswing
