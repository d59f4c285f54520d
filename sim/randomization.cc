#include "sim/randomization.h"

#include <algorithm>

namespace upswing {
namespace {

constexpr double Plant::*kParameters[] = {&Plant::mass1,   &Plant::mass2,       &Plant::length1,
                                          &Plant::length2, &Plant::damping1,    &Plant::damping2,
                                          &Plant::gravity, &Plant::torque_limit};

}  // namespace

void Randomization::Describe(Options& o) {
  constexpr Range kRelative{0, 0.99};  // what is drawn stays positive
  auto& [mass1, mass2, length1, length2, damping1, damping2, gravity, torque_limit] = plant;
  o.Section("randomize");
  const auto add = [&](double* target, std::string_view name, std::string_view what) {
    o.Add(target, name, kRelative, "", what);
  };
  add(&mass1, "randomize_mass1", "each episode's mass1 is within ± this share of the plant's");
  add(&mass2, "randomize_mass2", "the same of mass2");
  add(&length1, "randomize_length1", "the same of length1");
  add(&length2, "randomize_length2", "the same of length2");
  add(&damping1, "randomize_damping1", "the same of damping1");
  add(&damping2, "randomize_damping2", "the same of damping2");
  add(&gravity, "randomize_gravity", "the same of gravity");
  add(&torque_limit, "randomize_torque_limit", "the same of torque_limit");
  o.Add(&sensor_noise, "randomize_sensor_noise", {0, 10}, "rad, rad/s",
        "each episode's sensor noise is up to so much above sensor_noise");
  o.Add(&delay, "randomize_delay", {0, kLargestDelay}, "s",
        "each episode's delay is up to so much above delay")
      .step = kControlPeriod;
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
  return sensor_noise > 0 || delay > 0 ||
         std::ranges::any_of(plant, [](double x) { return x > 0; });
}

Plant Randomization::Draw(const Plant& nominal, Rng& rng) const {
  Plant drawn = nominal;
  for (size_t k = 0; k < plant.size(); ++k) {
    drawn.*kParameters[k] *= 1 + rng.Uniform(-plant[k], plant[k]);
  }
  return drawn;
}

Disturbance Randomization::Draw(const Disturbance& nominal, Rng& rng) const {
  const double noise = nominal.sensor_noise + rng.Uniform(0, sensor_noise);
  const int more = static_cast<int>(rng.Uniform() * (max_delay_steps() + 1));
  return {noise, (nominal.delay_steps() + more) * kControlPeriod};
}

}  // namespace upswing
