#pragma once

#include <cstdint>
#include <span>

#include "base/matrix.h"

namespace upswing {

/// Inputs of generalised advantages: T steps of N environments. All are (T × N).
struct AdvantageInputs {
  Matrix<const float> reward;      // r
  Matrix<const float> value;       // V(s)
  Matrix<const float> next_value;  // V(s') of the true successor s', also where an episode ends
  Matrix<const uint8_t> terminated, truncated;
};

/// Generalised advantage estimates A (T × N), GAE(γ, λ) (Schulman et al., 2016, Eq 16), computed
/// backwards:
///   δ = r + γ (1 - terminated) V(s') - V(s)
///   A = δ + γ λ (1 - terminated) (1 - truncated) A'
/// A truncated episode has a future, and its value is V(s'). A' belongs to the next episode there,
/// so the sum stops.
void GeneralizedAdvantages(const AdvantageInputs& in, double gamma, double lambda,
                           Matrix<float> advantage);

/// Shifts and scales numbers to mean 0 and standard deviation 1. Equal numbers become 0.
void Standardize(std::span<float> values);

/// Share of the variance of the targets that the predictions explain, 1 - Var(target - prediction)
/// / Var(target). It is at most 1, and 0 for a constant prediction or constant targets.
double ExplainedVariance(std::span<const float> target, std::span<const float> prediction);

}  // namespace upswing
