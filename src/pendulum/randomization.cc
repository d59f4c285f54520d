#include "pendulum/randomization.h"

#include <algorithm>

#include "base/error.h"

namespace upswing {
void Randomization::Describe(Options& o) {
  constexpr Range kRelative{0, 0.99};  // drawn values stay positive
  o.Section("randomize");
  for (size_t k = 0; k < plant.size(); ++k) {
    const std::string name = kPlantParameters.at(k).name;
    o.Add(&plant[k], "randomize_" + name, kRelative, "",
          "draw " + name + " for each episode within ± this share of its nominal value");
  }
  o.Add(&sensor_noise, "randomize_sensor_noise", {0, 10}, "rad, rad/s",
        "largest random increase of sensor_noise, drawn for each episode");
  o.Add(&delay, "randomize_delay", {0, kLargestDelay}, "s",
        "largest random increase of delay, drawn for each episode");
  o.Add(&sensor_latency, "randomize_sensor_latency", {0, kLongestLatency}, "s",
        "largest random increase of sensor_latency, drawn for each episode");
  o.Add(&from_posterior, "randomize_posterior",
        "draw the plant and the sensors for each episode from the covariance of a twin (--plant)");
  o.Add(&posterior, "posterior",
        "covariance for randomize_posterior, rows NAME NUMBERS of its lower triangle with ; "
        "between them; --plant sets it");
  o.Alias(
      "randomize",
      {"randomize_mass1", "randomize_mass2", "randomize_length1", "randomize_length2",
       "randomize_damping1", "randomize_damping2", "randomize_gravity"},
      "draw masses, lengths, dampings and gravity for each episode within ± this share of their "
      "nominal values");
  o.Alias("randomize_mass", {"randomize_mass1", "randomize_mass2"});
  o.Alias("randomize_length", {"randomize_length1", "randomize_length2"});
  o.Alias("randomize_damping", {"randomize_damping1", "randomize_damping2"});
}

bool Randomization::any() const {
  return from_posterior || sensor_noise > 0 || delay > 0 || sensor_latency > 0 ||
         std::ranges::any_of(plant, [](double x) { return x > 0; });
}

std::optional<Posterior> Randomization::MakePosterior() const {
  if (posterior.empty()) {
    if (!from_posterior) return std::nullopt;
    throw BadInput(
        "randomize_posterior: expected --plant with a twin that has a covariance of its plant, "
        "got none");
  }
  const Posterior parsed = Posterior::Parse(posterior, "posterior");
  return from_posterior ? std::optional(parsed) : std::nullopt;
}

void Randomization::DropUnused() {
  if (!from_posterior) posterior.clear();
}

Plant Randomization::Draw(const Plant& nominal, Rng& rng) const {
  Plant drawn = nominal;
  for (size_t k = 0; k < plant.size(); ++k) {
    drawn.*kPlantParameters.at(k).value *= 1 + rng.Uniform(-plant[k], plant[k]);
  }
  return drawn;
}

Disturbance Randomization::Draw(const Disturbance& nominal, double control_period, Rng& rng) const {
  Disturbance drawn = nominal;
  drawn.sensor_noise += rng.Uniform(0, sensor_noise);
  const int most = Disturbance{0, delay}.delay_steps(control_period);
  const int more = static_cast<int>(rng.Uniform() * (most + 1));
  drawn.delay = (nominal.delay_steps(control_period) + more) * control_period;
  // Runs of earlier versions drew no third number.
  if (sensor_latency > 0) drawn.sensors.latency += rng.Uniform(0, sensor_latency);
  return drawn;
}

Disturbance Randomization::Largest(const Disturbance& nominal) const {
  Disturbance largest = nominal;
  largest.sensor_noise += sensor_noise;
  largest.delay += delay;
  largest.sensors.latency += sensor_latency;
  return from_posterior ? MakePosterior()->Largest(largest) : largest;
}

}  // namespace upswing
