#pragma once

#include <array>
#include <optional>
#include <string>

#include "base/options.h"
#include "base/rng.h"
#include "pendulum/disturbance.h"
#include "pendulum/plant.h"
#include "pendulum/posterior.h"

namespace upswing {

/// Domain randomisation: how far the plant, sensors and motor of each episode may be from the
/// nominal ones; zeros: no randomisation.
struct Randomization {
  /// Half-widths relative to the nominal value, in the order of kPlantParameters: 0.25 stands for
  /// ±25%.
  std::array<double, kMainParameters> plant{};
  double sensor_noise = 0;      // largest addition to the nominal noise, rad, rad/s
  double delay = 0;             // largest addition to the delay, s
  double sensor_latency = 0;    // largest addition to the sensor latency, s
  bool from_posterior = false;  // also draw from `posterior`
  std::string posterior;        // as Posterior::Parse reads it; empty: none

  /// Declares each setting in `options`: name, range, unit, help.
  void Describe(Options& options);
  bool any() const;
  /// The posterior that plants and sensors are drawn from; none unless `from_posterior`. Throws
  /// BadInput if there is none to draw from, or if `posterior` is malformed.
  std::optional<Posterior> MakePosterior() const;
  /// Removes a posterior that nothing is drawn from.
  void DropUnused();
  /// Draws a plant from the box: each parameter is uniform and independent of the others. Always
  /// draws eight numbers from the stream.
  Plant Draw(const Plant& nominal, Rng& rng) const;
  /// Draws a disturbance: uniform noise, a uniform number of control periods (s) of delay, and a
  /// uniform latency. Draws two numbers from the stream, and a third if the latency is random.
  Disturbance Draw(const Disturbance& nominal, double control_period, Rng& rng) const;
  /// The largest values that Draw may return.
  Disturbance Largest(const Disturbance& nominal) const;
};

}  // namespace upswing
