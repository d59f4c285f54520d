#include "rl/representation.h"

#include <algorithm>
#include <numeric>
#include <vector>

namespace upswing {

double FeatureRank(Matrix<const float> features) {
  // XXᵀ has the same nonzero eigenvalues. Its trace is Σ λ, and the sum of its squared entries is Σ
  // λ². A copy by columns lets the products of a row with all earlier rows advance together.
  const int rows = features.rows(), cols = features.cols();
  std::vector<float> columns(static_cast<size_t>(rows) * cols);
  for (int i = 0; i < rows; ++i) {
    for (int k = 0; k < cols; ++k) columns[k * rows + i] = features(i, k);
  }
  double trace = 0, squares = 0;
  std::vector<double> dots(rows);
  for (int i = 0; i < rows; ++i) {
    std::ranges::fill(dots, 0.0);
    for (int k = 0; k < cols; ++k) {
      const float* column = columns.data() + k * rows;
      const float x = column[i];
      for (int j = 0; j <= i; ++j) dots[j] += x * column[j];
    }
    trace += dots[i];
    for (int j = 0; j <= i; ++j) squares += (i == j ? 1 : 2) * dots[j] * dots[j];
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
  constexpr int64_t kMostRows = 256;  // enough rows of a large minibatch
  const Matrix<const float> rows(features.data(), static_cast<int>(std::min(batch, kMostRows)),
                                 static_cast<int>(width));
  metrics.emplace_back("feature_rank", FeatureRank(rows));
  metrics.emplace_back("dormant_share", DormantShare(rows));
}

}  // namespace upswing
