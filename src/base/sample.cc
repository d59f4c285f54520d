#include "base/sample.h"

#include <algorithm>
#include <cmath>
#include <numeric>

namespace upswing {

double Quantile(std::span<const double> sorted, double share) {
  const double place = share * static_cast<double>(sorted.size() - 1);
  const auto below = static_cast<size_t>(place);
  const size_t above = std::min(below + 1, sorted.size() - 1);
  const double between = place - static_cast<double>(below);
  // Avoid NaN from interpolation between infinities and from 0 times infinity.
  if (between == 0 || std::isinf(sorted[below])) return sorted[below];
  return std::lerp(sorted[below], sorted[above], between);
}

Quartiles QuartilesOf(std::vector<double> values) {
  if (values.empty()) return {};
  std::ranges::sort(values);
  return {Quantile(values, 0.25), Quantile(values, 0.5), Quantile(values, 0.75)};
}

Interval WilsonInterval(int64_t successes, int64_t trials) {
  if (trials == 0) return {};
  constexpr double kZ = 1.959963984540054;  // 97.5% quantile of the standard normal
  const double n = static_cast<double>(trials);
  const double p = static_cast<double>(successes) / n;
  const double center = (p + kZ * kZ / (2 * n)) / (1 + kZ * kZ / n);
  const double half = kZ / (1 + kZ * kZ / n) * std::sqrt(p * (1 - p) / n + kZ * kZ / (4 * n * n));
  // Keep the bounds 0 and 1 free from rounding.
  return {successes == 0 ? 0.0 : center - half, successes == trials ? 1.0 : center + half};
}

Moments MomentsOf(std::span<const double> values) {
  if (values.empty()) return {};
  const double n = static_cast<double>(values.size());
  const double mean = std::accumulate(values.begin(), values.end(), 0.0) / n;
  double squares = 0;
  for (const double x : values) squares += (x - mean) * (x - mean);
  return {mean, n > 1 ? std::sqrt(squares / (n - 1)) : 0.0};
}

}  // namespace upswing
