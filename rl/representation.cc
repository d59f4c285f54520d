#include "rl/representation.h"

#include <algorithm>
#include <numeric>
#include <vector>

namespace upswing {

double FeatureRank(Matrix<const float> features) {
  // XXᵀ has the same nonzero eigenvalues; its trace is Σ λ, the sum of its squared entries Σ λ².
  double trace = 0, squares = 0;
  for (int i = 0; i < features.rows(); ++i) {
    const auto x = features.row(i);
    for (int j = 0; j <= i; ++j) {
      const double dot = std::inner_product(x.begin(), x.end(), features.row(j).begin(), 0.0);
      if (i == j) trace += dot;
      squares += (i == j ? 1 : 2) * dot * dot;
    }
  }
  return squares > 0 ? trace * trace / squares : 0;
}

double DormantShare(Matrix<const float> features) {
  std::vector<double> sums(static_cast<size_t>(features.cols()));
  for (int i = 0; i < features.rows(); ++i) {
    const auto x = features.row(i);
    for (size_t unit = 0; unit < sums.size(); ++unit) sums[unit] += x[unit];
  }
  const double units = static_cast<double>(sums.size());
  const double threshold = 0.025 * std::accumulate(sums.begin(), sums.end(), 0.0) / units;
  const auto dormant = std::ranges::count_if(sums, [&](double sum) { return sum <= threshold; });
  return static_cast<double>(dormant) / units;
}

void AddFeatureMetrics(std::span<const float> features, int64_t batch, int64_t width,
                       Metrics& metrics) {
  constexpr int64_t kMostRows = 256;  // enough of a large minibatch
  const Matrix<const float> rows(features.data(), static_cast<int>(std::min(batch, kMostRows)),
                                 static_cast<int>(width));
  metrics.emplace_back("feature_rank", FeatureRank(rows));
  metrics.emplace_back("dormant_share", DormantShare(rows));
}

}  // namespace upswing
