#pragma once

#include <span>

#include "core/matrix.h"
#include "core/rng.h"
#include "nn/network.h"

namespace upswing {

/// Fills w (in × out) with `gain` times a random matrix whose rows (in ≤ out) or columns are
/// orthonormal (Saxe et al., 2014), uniformly drawn: Gram-Schmidt of a matrix of normal numbers.
void OrthogonalWeights(Rng& rng, double gain, Matrix<float> w);

/// Initial parameters for policy gradients (Andrychowicz et al., 2021): orthogonal weights, with
/// gain √2 in the hidden layers and `output_gain` in the output layer, biases 0, gains of layer
/// normalisation 1. The network's head is one linear layer.
void InitializeOrthogonal(const Network& network, double output_gain, Rng& rng,
                          std::span<float> parameters);

}  // namespace upswing
