#pragma once

#include <algorithm>
#include <cmath>
#include <numbers>
#include <span>

/// Diagonal Gaussian policies, one action component at a time. The log-probability of an action is
/// the sum over its components.
///
/// u = μ + σ ε with ε ~ N(0, 1) is the unbounded action. The action of a squashed policy is
/// a = tanh(u), within ±1 (Haarnoja et al., 2018, Appendix C). The environment receives limit · a;
/// all probabilities here refer to a or u. T = float for training, double for gradient checks.
namespace upswing {

inline constexpr double kLogStdLow = -5, kLogStdHigh = 2;  // ln σ is clamped to this range

/// The policy at one observation.
template <typename T>
struct Gaussian {
  T mean = 0;            // μ
  T log_std = 0;         // ln σ
  T std = 1;             // σ
  bool clamped = false;  // whether ln σ is at an end of its range and has no gradient

  /// Makes a Gaussian from the outputs of a network.
  static Gaussian From(T mean, T log_std) {
    constexpr T kLow = kLogStdLow, kHigh = kLogStdHigh;
    const T clamped = std::clamp(log_std, kLow, kHigh);
    return {mean, clamped, std::exp(clamped), clamped != log_std};
  }
};

/// Φ(x), the distribution function of a standard normal.
inline double NormalCdf(double x) { return std::erfc(-x / std::numbers::sqrt2) / 2; }

/// A map of the unbounded action u to the action a within ±1.
struct ActionBound {
  double (*bounded)(double u);
  double (*unbounded)(double a);  // its inverse: the u from which on the action is at least a
};
extern const ActionBound kSquash;  // a = tanh(u)
extern const ActionBound kClip;    // a = u, cut off at ±1

/// Probabilities (n + 2) of the actions of a policy with this bound. The first and the last are the
/// probabilities of clipping to -1 and to 1. The others belong to n equal intervals between -1 and
/// 1.
inline void ActionProbabilities(const Gaussian<double>& policy, const ActionBound& bound,
                                std::span<double> probabilities) {
  const size_t pieces = probabilities.size() - 2;
  double below = 0;
  for (size_t i = 0; i <= pieces; ++i) {
    const double end = 2 * static_cast<double>(i) / static_cast<double>(pieces) - 1;
    const double up_to = NormalCdf((bound.unbounded(end) - policy.mean) / policy.std);
    probabilities[i] = up_to - below;
    below = up_to;
  }
  probabilities.back() = 1 - below;
}

/// ln N(u; μ, σ²) of the sample u = μ + σ · `epsilon`.
template <typename T>
T LogDensity(T epsilon, T log_std) {
  static const T kHalfLogTwoPi = std::log(2 * std::numbers::pi_v<T>) / 2;
  return -epsilon * epsilon / 2 - log_std - kHalfLogTwoPi;
}

/// A sample of a squashed policy; SquashSamples of linear.h makes many.
template <typename T>
struct Squashed {
  T epsilon = 0, action = 0;  // ε, a = tanh(u)
  T log_prob = 0;             // ln π(a) = ln N(u) - ln(1 - a²)
};

/// Gradient with respect to μ and ln σ.
template <typename T>
struct GaussianGradient {
  T mean = 0, log_std = 0;
};

/// Gradient of α ln π(a) - Q(a) through the sample a = tanh(μ + σ ε), given dQ/da (Haarnoja et al.,
/// 2018, Eq 7):
///   d/dμ = 2 α a - Q_a (1 - a²),  d/dlnσ = α (2 a σ ε - 1) - Q_a (1 - a²) σ ε.
template <typename T>
GaussianGradient<T> SquashedGradient(const Gaussian<T>& policy, const Squashed<T>& sample, T alpha,
                                     T dq_da) {
  const T du = 2 * alpha * sample.action - dq_da * (1 - sample.action * sample.action);
  const T scale = policy.std * sample.epsilon;
  return {du, policy.clamped ? 0 : du * scale - alpha};
}

}  // namespace upswing
