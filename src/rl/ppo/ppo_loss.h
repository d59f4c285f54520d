#pragma once

#include <algorithm>

/// Losses of proximal policy optimisation for one step of a rollout. r = π(a|s)/π_old(a|s), A
/// advantage, V value, R its target. T = float for training, double for gradient checks.
namespace upswing {

template <typename T>
struct LossTerm {
  T loss;
  T gradient;  // with respect to ln π(a|s), or to V
};

/// Policy loss -min(r A, clip(r, 1 - ε, 1 + ε) A), to be minimised (Schulman et al., 2017, Eq 7).
/// It has no gradient where the clipped product is smaller: at r > 1 + ε with A > 0, and at r < 1 -
/// ε with A < 0.
template <typename T>
LossTerm<T> ClippedLoss(T ratio, T advantage, T epsilon) {
  const T whole = ratio * advantage;
  const T clipped = std::clamp(ratio, 1 - epsilon, 1 + epsilon) * advantage;
  if (clipped < whole) return {-clipped, 0};
  return {-whole, -whole};  // dr/dln π = r
}

/// Value loss ½ max((V - R)², (clip(V, V_old ± ε) - R)²). A value gains nothing by moving further
/// than ε from its value at the beginning of the rollout. With ε = 0, the loss is ½ (V - R)².
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

/// (r - 1) - ln r: an estimate of KL(π_old ‖ π) from actions of π_old. It is never below 0
/// (Schulman, "Approximating KL Divergence", 2020).
template <typename T>
T KlEstimate(T ratio, T log_ratio) {
  return (ratio - 1) - log_ratio;
}

}  // namespace upswing
