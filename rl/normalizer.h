#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "core/archive.h"
#include "core/matrix.h"

namespace upswing {

/// Running mean and standard deviation of each observation (D), of all that were ever added.
/// Before the first addition it changes nothing.
class Normalizer {
 public:
  /// The smallest standard deviation that counts, in the unit of an observation: one that hardly
  /// changed so far is not blown up.
  static constexpr double kLeastDeviation = 0.01;

  explicit Normalizer(int obs_size);

  /// Adds observations (rows × D), by the pairwise update of Chan et al. (1983).
  void Add(Matrix<const float> obs);

  /// normal (D) = (obs - mean) / deviation.
  void Apply(std::span<const float> obs, std::span<float> normal) const {
    for (size_t k = 0; k < obs.size(); ++k) normal[k] = (obs[k] - center_[k]) * scale_[k];
  }

  /// (D)
  const std::vector<double>& mean() const { return mean_; }
  std::vector<double> deviation() const;

  /// Saves or loads the statistics.
  void State(const Archive& archive);

 private:
  /// Writes what Apply uses.
  void Update();

  int64_t count_ = 0;
  std::vector<double> mean_, squares_;  // (D) mean, Σ (obs - mean)²
  std::vector<float> center_, scale_;   // (D) mean, 1 / deviation
};

}  // namespace upswing
