#pragma once

#include <cstddef>
#include <span>

#include "base/rng.h"
#include "nn/gaussian.h"
#include "rl/ppo/softmax.h"

/// Action distributions of policy gradients at one observation. T = float for training, double for
/// gradient checks.
namespace upswing {

/// Independent normal components u (A), in units of each action's limit. σ does not depend on the
/// observation.
template <typename T>
struct DiagonalGaussian {
  std::span<const T> mean;            // (A) μ, the network's outputs
  std::span<const T> log_std, sigma;  // (A) ln σ, σ

  void Sample(Rng& rng, std::span<T> u) const {
    for (size_t k = 0; k < u.size(); ++k) u[k] = mean[k] + sigma[k] * static_cast<T>(rng.Normal());
  }

  T LogProb(std::span<const T> u) const {
    T sum = 0;
    for (size_t k = 0; k < u.size(); ++k) sum += LogDensity(Epsilon(u, k), log_std[k]);
    return sum;
  }

  /// H = Σ (ln σ + ½ ln 2π + ½)
  T Entropy() const {
    T sum = 0;
    for (const T x : log_std) sum += T(0.5) - LogDensity(T(0), x);
    return sum;
  }

  /// Writes dL/dμ and adds dL/dlnσ, given dL/dln π(u) and dL/dH:
  ///   dln π/dμ = (u - μ)/σ², dln π/dlnσ = ((u - μ)/σ)² - 1, dH/dlnσ = 1.
  void Backward(std::span<const T> u, T dlog_prob, T dentropy, std::span<T> dmean,
                std::span<T> dlog_std) const {
    for (size_t k = 0; k < u.size(); ++k) {
      const T epsilon = Epsilon(u, k);
      dmean[k] = dlog_prob * epsilon / sigma[k];
      dlog_std[k] += dlog_prob * (epsilon * epsilon - 1) + dentropy;
    }
  }

 private:
  T Epsilon(std::span<const T> u, size_t k) const { return (u[k] - mean[k]) / sigma[k]; }
};

/// Distribution over K actions, p = softmax(logits).
template <typename T>
class Categorical {
 public:
  /// Writes p (K). The caller must not change it afterwards.
  Categorical(std::span<const T> logits, std::span<T> p)
      : logits_(logits), p_(p), log_sum_(Softmax<T>(logits, p)) {}

  size_t Sample(Rng& rng) const {
    T left = static_cast<T>(rng.Uniform());
    for (size_t k = 0; k + 1 < p_.size(); ++k) {
      left -= p_[k];
      if (left < 0) return k;
    }
    return p_.size() - 1;
  }

  T LogProb(size_t action) const { return logits_[action] - log_sum_; }

  /// H = -Σ p ln p
  T Entropy() const {
    T sum = 0;
    for (size_t k = 0; k < p_.size(); ++k) sum -= p_[k] * LogProb(k);
    return sum;
  }

  /// Writes dL/dlogits, given dL/dln π(action) and dL/dH:
  ///   dln π(a)/dlogit_k = [k = a] - p_k, dH/dlogit_k = -p_k (ln p_k + H).
  void Backward(size_t action, T dlog_prob, T dentropy, std::span<T> dlogits) const {
    const T entropy = dentropy == 0 ? 0 : Entropy();
    for (size_t k = 0; k < p_.size(); ++k) {
      const T hit = k == action ? 1 : 0;
      dlogits[k] = dlog_prob * (hit - p_[k]) - dentropy * p_[k] * (LogProb(k) + entropy);
    }
  }

 private:
  std::span<const T> logits_;
  std::span<T> p_;
  T log_sum_;
};

}  // namespace upswing
