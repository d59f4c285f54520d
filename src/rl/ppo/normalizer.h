#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "base/archive.h"
#include "base/matrix.h"

namespace upswing {

/// Running mean and standard deviation of each observation (D), over all added observations. Before
/// the first addition, normalisation changes nothing.
class Normalizer {
 public:
  /// Lower limit of the standard deviation, in the unit of an observation. It keeps small an
  /// observation that has hardly changed so far.
  static constexpr double kLeastDeviation = 0.01;

  explicit Normalizer(int obs_size);

  /// Adds observations (rows × D) by the pairwise update of Chan et al. (1983).
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
  /// Updates center_ and scale_ for Apply.
  void Update();

  int64_t count_ = 0;
  std::vector<double> mean_, squares_;  // (D) mean, Σ (obs - mean)²
  std::vector<float> center_, scale_;   // (D) mean, 1 / deviation
};

}  // namespace upswing
