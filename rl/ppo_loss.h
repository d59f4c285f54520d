#pragma once

#include <algorithm>

/// The losses of proximal policy optimisation for one step of a rollout. r = π(a|s)/π_old(a|s), A
/// advantage, V value, R its target. T = float to work, double to check gradients.
namespace upswing {

template <typename T>
struct LossTerm {
  T loss;
  T gradient;  // with respect to ln π(a|s), or to V
};

/// -min(r A, clip(r, 1 - ε, 1 + ε) A), which is to be small (Schulman et al., 2017, Eq 7). There is
/// no gradient where the clipped product is the smaller one: at r > 1 + ε with A > 0, at r < 1 - ε
/// with A < 0.
template <typename T>
LossTerm<T> ClippedLoss(T ratio, T advantage, T epsilon) {
  const T whole = ratio * advantage;
  const T clipped = std::clamp(ratio, 1 - epsilon, 1 + epsilon) * advantage;
  if (clipped < whole) return {-clipped, 0};
  return {-whole, -whole};  // dr/dln π = r
}

/// ½ max((V - R)², (clip(V, V_old ± ε) - R)²): a value gains nothing by going further than ε from
/// what it was when the rollout began. With ε = 0 simply ½ (V - R)².
template <typename T>
LossTerm<T> ValueLoss(T value, T old_value, T target, T epsilon) {
  const T error = value - target;
  const LossTerm<T> whole{error * error / 2, error};
  if (epsilon == 0) return whole;
  const T near = std::clamp(value, old_value - epsilon, old_value + epsilon);
  const T clipped = (near - target) * (near - target) / 2;
  if (near == value || clipped <= whole.loss) return whole;
  return {clipped, 0};
}

/// (r - 1) - ln r: an estimate of KL(π_old ‖ π) from actions of π_old, never below 0 (Schulman,
/// "Approximating KL Divergence", 2020).
template <typename T>
T KlEstimate(T ratio, T log_ratio) {
  return (ratio - 1) - log_ratio;
}

}  // namespace upswing
