#include "sim/randomization.h"

#include <algorithm>

namespace upswing {
namespace {

/// A parameter of the plant that may be random.
struct Parameter {
  const char* name;
  double Plant::*value;
};
constexpr Parameter kParameters[] = {
    {"mass1", &Plant::mass1},       {"mass2", &Plant::mass2},
    {"length1", &Plant::length1},   {"length2", &Plant::length2},
    {"damping1", &Plant::damping1}, {"damping2", &Plant::damping2},
    {"gravity", &Plant::gravity},   {"torque_limit", &Plant::torque_limit}};

}  // namespace

void Randomization::Describe(Options& o) {
  constexpr Range kRelative{0, 0.99};  // what is drawn stays positive
  o.Section("randomize");
  for (size_t k = 0; k < plant.size(); ++k) {
    const std::string name = kParameters[k].name;
    o.Add(&plant[k], "randomize_" + name, kRelative, "",
          "each episode's " + name + " is within ± this share of the plant's");
  }
  o.Add(&sensor_noise, "randomize_sensor_noise", {0, 10}, "rad, rad/s",
        "each episode's sensor noise is up to this much above sensor_noise");
  o.Add(&delay, "randomize_delay", {0, kLargestDelay}, "s",
        "each episode's delay is up to this much above delay")
      .step = kControlPeriod;
  o.Add(&sensor_latency, "randomize_sensor_latency", {0, kLongestLatency}, "s",
        "each episode's sensor latency is up to this much above sensor_latency")
      .implied = true;
  o.Alias("randomize",
          {"randomize_mass1", "randomize_mass2", "randomize_length1", "randomize_length2",
           "randomize_damping1", "randomize_damping2", "randomize_gravity"},
          "share: each episode's masses, lengths, dampings and gravity are within ± this of the "
          "plant's");
  o.Alias("randomize_mass", {"randomize_mass1", "randomize_mass2"});
  o.Alias("randomize_length", {"randomize_length1", "randomize_length2"});
  o.Alias("randomize_damping", {"randomize_damping1", "randomize_damping2"});
}

bool Randomization::any() const {
  return sensor_noise > 0 || delay > 0 || sensor_latency > 0 ||
         std::ranges::any_of(plant, [](double x) { return x > 0; });
}

Plant Randomization::Draw(const Plant& nominal, Rng& rng) const {
  Plant drawn = nominal;
  for (size_t k = 0; k < plant.size(); ++k) {
    drawn.*kParameters[k].value *= 1 + rng.Uniform(-plant[k], plant[k]);
  }
  return drawn;
}

Disturbance Randomization::Draw(const Disturbance& nominal, Rng& rng) const {
  Disturbance drawn = nominal;
  drawn.sensor_noise += rng.Uniform(0, sensor_noise);
  const int most = Disturbance{0, delay}.delay_steps();
  const int more = static_cast<int>(rng.Uniform() * (most + 1));
  drawn.delay = (nominal.delay_steps() + more) * kControlPeriod;
  // Trainings of earlier versions drew no third number.
  if (sensor_latency > 0) drawn.sensors.latency += rng.Uniform(0, sensor_latency);
  return drawn;
}

Disturbance Randomization::Largest(const Disturbance& nominal) const {
  Disturbance largest = nominal;
  largest.sensor_noise += sensor_noise;
  largest.delay += delay;
  largest.sensors.latency += sensor_latency;
  return largest;
}

}  // namespace upswing
