#pragma once

#include <span>

#include "base/matrix.h"
#include "base/rng.h"
#include "nn/network.h"

namespace upswing {

/// Fills w (in × out) with `gain` times a random matrix whose rows (if in ≤ out) or columns are
/// orthonormal (Saxe et al., 2014). Gram-Schmidt of normal numbers makes the matrix uniformly
/// distributed.
void OrthogonalWeights(Rng& rng, double gain, Matrix<float> w);

/// Sets initial parameters for policy gradients (Andrychowicz et al., 2021). Weights are
/// orthogonal, with gain √2 in the hidden layers and `output_gain` in the output layer. Biases are
/// 0 and gains of layer normalisation are 1. The network's head must be one linear layer.
void InitializeOrthogonal(const Network& network, double output_gain, Rng& rng,
                          std::span<float> parameters);

}  // namespace upswing
