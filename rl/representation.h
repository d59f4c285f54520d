#pragma once

#include <cstdint>
#include <span>

#include "core/matrix.h"
#include "rl/agent.h"

/// How much of its capacity a network uses: two measures that show when its features degenerate.
namespace upswing {

/// Participation ratio (Σ λ)² / Σ λ² of the eigenvalues λ of XᵀX, for features X (B × W): 1 if all
/// rows point in one direction, up to min(B, W) if they fill all evenly. A smooth relative of the
/// effective rank of Kumar et al. (2021); 0 if all features are 0.
double FeatureRank(Matrix<const float> features);

/// Share of the units (columns of features (B × W) after ReLU) whose mean activation is at most
/// 0.025 of the layer's mean (Sokar et al., 2023, Definition 3.1); 1 if all features are 0.
double DormantShare(Matrix<const float> features);

/// Adds both as columns, of the features (batch × width) of the last minibatch.
void AddFeatureMetrics(std::span<const float> features, int64_t batch, int64_t width,
                       Metrics& metrics);

}  // namespace upswing
