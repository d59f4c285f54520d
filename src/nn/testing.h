#pragma once

#include <cmath>
#include <numbers>

#include "nn/gaussian.h"

/// Scalar references of kernels, for tests.
namespace upswing {

/// ln(1 - tanh²(u)), the logarithm of the slope of tanh, from size = |u| and e = exp(-2 |u|). This
/// is the stable form 2 (ln 2 - u - softplus(-2u)). It is exact for any u, because by symmetry |u|
/// can replace u.
template <typename T>
T LogTanhSlope(T size, T e) {
  return 2 * (std::numbers::ln2_v<T> - size - std::log1p(e));
}

/// Makes the sample of ε, as SquashSamples does for many samples at once.
template <typename T>
Squashed<T> Squash(const Gaussian<T>& policy, T epsilon) {
  // One e = exp(-2 |u|) serves tanh(|u|) = (1 - e) / (1 + e) and ln(1 - a²).
  const T u = policy.mean + policy.std * epsilon, size = std::abs(u), e = std::exp(-2 * size);
  return {epsilon, std::copysign((1 - e) / (1 + e), u),
          LogDensity(epsilon, policy.log_std) - LogTanhSlope(size, e)};
}

}  // namespace upswing
