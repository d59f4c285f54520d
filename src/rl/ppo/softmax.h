#pragma once

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <span>

namespace upswing {

/// Writes p = softmax(x) and returns ln Σ exp(x), without overflow. T = float for training, double
/// for gradient checks.
template <typename T>
T Softmax(std::span<const T> x, std::span<T> p) {
  const T largest = *std::ranges::max_element(x);
  T sum = 0;
  for (size_t k = 0; k < p.size(); ++k) sum += p[k] = std::exp(x[k] - largest);
  for (T& share : p) share /= sum;
  return largest + std::log(sum);
}

}  // namespace upswing
