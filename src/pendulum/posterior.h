#pragma once

#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "base/options.h"
#include "base/rng.h"
#include "pendulum/disturbance.h"
#include "pendulum/plant.h"

namespace upswing {

/// The range of an uncertain value: that of its setting. A centre or inertia of a link stays above
/// 0, which stands for a capsule.
Range UncertainRange(const Option& option);

/// The next row of the Cholesky factor L. `covariance`: the value's covariances with the values
/// above, then its variance. Nothing if the matrix is not positive semidefinite. A value without
/// variance has a row of zeros.
std::optional<std::vector<double>> FactorRow(const std::vector<double>& covariance,
                                             const std::vector<std::vector<double>>& rows);

/// A joint normal distribution of a machine's values about the nominal ones, such as the posterior
/// of an identification. The values are settings of the plant, and the sensors' latency and zeros.
class Posterior {
 public:
  /// Whether a posterior can have a value of this name.
  static bool Knows(std::string_view name);

  /// The text that Parse reads, with the covariance (n × n) of values called `names` (n).
  static std::string Text(const std::vector<std::string>& names,
                          const std::vector<double>& covariance);

  /// Parses rows of a covariance, separated by semicolons. A row has the name of a value, its
  /// covariances with the values of the rows above it, and its variance. Throws BadInput, with a
  /// message that begins with `where`, unless the matrix is positive.
  static Posterior Parse(std::string_view text, const std::string& where);

  /// Adds random deviations to a plant and its sensors. A value beyond its UncertainRange is cut at
  /// it. Takes a normal number from the stream for each value.
  void Deviate(Plant& plant, Disturbance& disturbance, Rng& rng) const;

  /// The largest values that Deviate may return.
  Disturbance Largest(const Disturbance& nominal) const;

 private:
  struct Value {
    double Plant::*of_plant = nullptr;  // one of the two is set
    double SensorModel::*of_sensors = nullptr;
    Range range;
  };
  std::vector<Value> values_;              // (n)
  std::vector<std::vector<double>> rows_;  // (n) rows of L, where the covariance is L L'
};

}  // namespace upswing
