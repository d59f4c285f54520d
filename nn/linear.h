#pragma once

#include <span>

#include "core/matrix.h"
#include "nn/real.h"

/// Kernels of small networks. B = batch size.
/// Every kernel is compiled for several kinds of vector instructions (core/simd.h). Apart from the
/// rooflines, only linear.cc and product.cc contain vector code.
///
/// The order of each sum depends on the sizes alone, not on a row's position in the batch: cutting
/// a batch into slices changes no bit.
namespace upswing {

/// y (B × out) = x (B × in) · W + b, with W (in × out) and b (out); y = max(y, 0) if `relu`.
/// W is the transpose of torch.nn.Linear's.
void LinearForward(Matrix<const Real> x, Matrix<const Real> w, std::span<const Real> b, bool relu,
                   Matrix<Real> y);

/// dx (B × in) = dy (B × out) · Wᵀ, given Wᵀ (out × in). If x is the output of a ReLU, `gate` is
/// that output (B × in), and dx = 0 where it is 0; else `gate` is empty.
void LinearBackwardInput(Matrix<const Real> dy, Matrix<const Real> w_transposed,
                         Matrix<const Real> gate, Matrix<Real> dx);

/// dW (in × out) = xᵀ (in × B) · dy (B × out).
void LinearBackwardWeight(Matrix<const Real> x, Matrix<const Real> dy, Matrix<Real> dw);

/// sum (n) of the rows of x (B × n).
void SumRows(Matrix<const Real> x, std::span<Real> sum);

/// y (cols × rows) = the transpose of x (rows × cols).
void Transpose(Matrix<const Real> x, Matrix<Real> y);

/// y = gain · x̂ + bias with x̂ = (x - mean) / sqrt(var + 1e-5) over each row (Ba et al., 2016,
/// Eq 3); y = max(y, 0) if `relu`. x (B × n) is replaced by x̂, and inv_std (B) = 1 / sqrt(var +
/// 1e-5), both for the backward pass.
void LayerNormForward(Matrix<Real> x, std::span<const Real> gain, std::span<const Real> bias,
                      std::span<Real> inv_std, bool relu, Matrix<Real> y);

/// dx (B × n) of the layer normalisation, given dy (B × n) before the ReLU, x̂ and inv_std.
void LayerNormBackwardInput(Matrix<const Real> x_hat, std::span<const Real> gain,
                            std::span<const Real> inv_std, Matrix<const Real> dy, Matrix<Real> dx);

/// dgain (n) = Σ dy · x̂ over the rows; the gradient of the bias is SumRows(dy).
void LayerNormBackwardGain(Matrix<const Real> x_hat, Matrix<const Real> dy, std::span<Real> dgain);

/// x = tanh(x), up to 4 units in the last place.
void Tanh(std::span<Real> x);

/// Its backward pass: dy = dy · (1 - y²), where y = tanh(x).
void TanhBackward(std::span<const Real> y, std::span<Real> dy);

/// Samples of squashed Gaussians (nn/gaussian.h), n components: of mean, log_std (in range) and
/// epsilon, deviation = exp(log_std), action = tanh(mean + deviation · epsilon), and the
/// log-probability of each, up to some units in the last place of Squash.
void SquashSamples(std::span<const Real> mean, std::span<const Real> log_std,
                   std::span<const Real> epsilon, std::span<Real> deviation, std::span<Real> action,
                   std::span<Real> log_prob);

/// Sum of squares.
Real SquaredNorm(std::span<const Real> x);

/// The constants of one step of Adam (Kingma and Ba, 2015, Algorithm 1), with both bias corrections
/// folded into step and epsilon, and of Polyak averaging.
struct AdamConstants {
  Real scale;          // of the gradient: below 1 if it is clipped
  Real beta1, beta2;   // decay of the moments
  Real step, epsilon;  // corrected step size and ε
  Real tau;            // of Polyak averaging
};

/// In one pass, with g scaled: m ← β1 m + (1-β1) g, v ← β2 v + (1-β2) g²,
/// p ← p - step · m / (sqrt(v) + ε), target ← target + tau · (p - target) unless `target` is empty.
void AdamPolyakStep(const AdamConstants& constants, std::span<const Real> g, std::span<Real> m,
                    std::span<Real> v, std::span<Real> p, std::span<Real> target);

}  // namespace upswing
