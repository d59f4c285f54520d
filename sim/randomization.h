#pragma once

#include <array>

#include "core/options.h"
#include "core/rng.h"
#include "sim/disturbance.h"
#include "sim/double_pendulum.h"

namespace upswing {

/// Domain randomisation: how far each episode's plant, sensors and motor may be from the
/// nominal ones; zeros: not at all.
struct Randomization {
  /// Half-widths relative to the nominal value, in the order of Plant: 0.25 stands for ±25%.
  std::array<double, 8> plant{};
  double sensor_noise = 0;    // largest addition to the nominal one, rad, rad/s
  double delay = 0;           // largest addition to the delay, s
  double sensor_latency = 0;  // largest addition to the sensor latency, s

  /// One line per setting: name, range, unit, help.
  void Describe(Options& options);
  bool any() const;
  /// A plant from the box: each parameter uniform and independent of the others. Always draws eight
  /// numbers from the stream.
  Plant Draw(const Plant& nominal, Rng& rng) const;
  /// Uniform noise, a uniform number of control periods, and a uniform latency. Draws two numbers
  /// from the stream, and a third if the latency is random.
  Disturbance Draw(const Disturbance& nominal, Rng& rng) const;
  /// The largest values that Draw may return.
  Disturbance Largest(const Disturbance& nominal) const;
};

}  // namespace upswing
