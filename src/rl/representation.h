#pragma once

#include <cstdint>
#include <span>

#include "base/matrix.h"
#include "rl/agent.h"

/// Measures of the capacity that a network uses. They show when its features degenerate.
namespace upswing {

/// Participation ratio (Σ λ)² / Σ λ² of the eigenvalues λ of XᵀX, for features X (B × W). It is 1
/// if all rows point in one direction, and up to min(B, W) if they fill all directions evenly. It
/// is a smooth relative of the effective rank of Kumar et al. (2021). It is 0 if all features are
/// 0.
double FeatureRank(Matrix<const float> features);

/// Share of dormant units (Sokar et al., 2023, Definition 3.1). A unit is a column of the features
/// (B × W) after ReLU. It is dormant if its mean activation is at most 0.025 of the layer's mean.
/// The share is 1 if all features are 0.
double DormantShare(Matrix<const float> features);

/// Adds FeatureRank and DormantShare of the last minibatch's features (batch × width) to the
/// metrics.
void AddFeatureMetrics(std::span<const float> features, int64_t batch, int64_t width,
                       Metrics& metrics);

}  // namespace upswing
