#pragma once

#include <cmath>
#include <cstdlib>
#include <filesystem>
#include <string>

#include "extras/machine/twin/twin.h"

/// Helpers for tests of machines.
namespace upswing::machine {

/// The folder of the measured data: UPSWING_REAL, or `../shared/real` next to the project's root.
/// Empty if there is none; a test then skips.
inline std::filesystem::path RealData() {
  const char* given = std::getenv("UPSWING_REAL");
  const std::filesystem::path root = std::filesystem::path(__FILE__).parent_path() / "../../..";
  const std::filesystem::path folder = given != nullptr ? given : root / "../shared/real";
  return std::filesystem::is_directory(folder) ? folder : std::filesystem::path();
}

/// A machine like RealAIGym's, with a delay and a lag of its motors and no jitter.
inline Twin TestTwin() {
  Twin twin;
  twin.plant.mass1 = 0.5;
  twin.plant.mass2 = 0.6;
  twin.plant.length1 = 0.2;
  twin.plant.length2 = 0.3;
  twin.plant.damping1 = twin.plant.damping2 = 0.005;
  twin.plant.coulomb1 = twin.plant.coulomb2 = 0.05;
  twin.actuator.delay = 0.003;
  twin.actuator.lag = 0.004;
  twin.actuator.passive_limit = 0.5;
  twin.sensors.quantum = 25.0 / 65535;
  twin.sensors.angle_range = 12.5;
  twin.sensors.zero1 = 0.02;
  twin.sensors.zero2 = -0.01;
  return twin;
}

/// The units of another size as multiples of those of a machine.
struct Image {
  double length = 1, mass = 1, time = 1;

  double inertia() const { return mass * length * length; }
  double torque() const { return inertia() / (time * time); }
  /// A unit of a setting, such as kg·m² or s, as a multiple of the machine's.
  double Of(const std::string& unit) const {
    if (unit == "kg") return mass;
    if (unit == "m") return length;
    if (unit == "m/s²") return length / (time * time);
    if (unit == "kg·m²") return inertia();
    if (unit == "N·m") return torque();
    if (unit == "N·m·s/rad") return torque() * time;
    if (unit == "s") return time;
    if (unit == "rad/s") return 1 / time;
    return 1;
  }
};

/// The units of a size in which time counts by the square root of lengths, and mass by volume.
inline Image ImageOfLength(double length) {
  return {length, std::pow(length, 3), std::sqrt(length)};
}

/// The image of a twin without sessions: the same machine, with its drives, its loop and its
/// covariance, in another size.
inline Twin ImageOf(const Twin& twin, const Image& image) {
  Twin copy = twin;
  const Options options = OptionsOf(copy);
  for (const Option& option : options.all()) {
    if (double* const* value = std::get_if<double*>(&option.target)) {
      **value *= image.Of(option.unit);
    }
  }
  const size_t n = copy.uncertain.size();
  for (size_t i = 0; i < n * n; ++i) {
    for (const size_t k : {i / n, i % n}) {
      copy.covariance[i] *= image.Of(options.Get(copy.uncertain[k])->unit);
    }
  }
  return copy;
}

}  // namespace upswing::machine
