#pragma once

#include <span>

#include "core/matrix.h"

/// Kernels of small networks, for T = float and double. B = batch size.
/// Every kernel is compiled for several kinds of vector instructions (core/simd.h). Apart from the
/// rooflines, only linear.cc and product.cc contain vector code.
///
/// The order of each sum depends on the sizes alone, not on a row's position in the batch: cutting
/// a batch into slices changes no bit.
namespace upswing {

/// y (B × out) = x (B × in) · W + b, with W (in × out) and b (out); y = max(y, 0) if `relu`.
/// W is the transpose of torch.nn.Linear's.
template <typename T>
void LinearForward(Matrix<const T> x, Matrix<const T> w, std::span<const T> b, bool relu,
                   Matrix<T> y);

/// dx (B × in) = dy (B × out) · Wᵀ, given Wᵀ (out × in). If x is the output of a ReLU, `gate` is
/// that output (B × in), and dx = 0 where it is 0; else `gate` is empty.
template <typename T>
void LinearBackwardInput(Matrix<const T> dy, Matrix<const T> w_transposed, Matrix<const T> gate,
                         Matrix<T> dx);

/// dW (in × out) = xᵀ (in × B) · dy (B × out).
template <typename T>
void LinearBackwardWeight(Matrix<const T> x, Matrix<const T> dy, Matrix<T> dw);

/// sum (n) of the rows of x (B × n).
template <typename T>
void SumRows(Matrix<const T> x, std::span<T> sum);

/// y (cols × rows) = the transpose of x (rows × cols).
template <typename T>
void Transpose(Matrix<const T> x, Matrix<T> y);

/// y = gain · x̂ + bias with x̂ = (x - mean) / sqrt(var + 1e-5) over each row (Ba et al., 2016,
/// Eq 3); y = max(y, 0) if `relu`. x (B × n) is replaced by x̂, and inv_std (B) = 1 / sqrt(var +
/// 1e-5), both for the backward pass.
template <typename T>
void LayerNormForward(Matrix<T> x, std::span<const T> gain, std::span<const T> bias,
                      std::span<T> inv_std, bool relu, Matrix<T> y);

/// dx (B × n) of the layer normalisation, given dy (B × n) before the ReLU, x̂ and inv_std.
template <typename T>
void LayerNormBackwardInput(Matrix<const T> x_hat, std::span<const T> gain,
                            std::span<const T> inv_std, Matrix<const T> dy, Matrix<T> dx);

/// dgain (n) = Σ dy · x̂ over the rows; the gradient of the bias is SumRows(dy).
template <typename T>
void LayerNormBackwardGain(Matrix<const T> x_hat, Matrix<const T> dy, std::span<T> dgain);

/// x = tanh(x), up to 4 units in the last place.
template <typename T>
void Tanh(std::span<T> x);

/// Its backward pass: dy = dy · (1 - y²), where y = tanh(x).
template <typename T>
void TanhBackward(std::span<const T> y, std::span<T> dy);

/// Samples of squashed Gaussians (nn/gaussian.h), n components: of mean, log_std (in range) and
/// epsilon, deviation = exp(log_std), action = tanh(mean + deviation · epsilon), and the
/// log-probability of each, up to some units in the last place of Squash.
template <typename T>
void SquashSamples(std::span<const T> mean, std::span<const T> log_std, std::span<const T> epsilon,
                   std::span<T> deviation, std::span<T> action, std::span<T> log_prob);

/// Sum of squares.
template <typename T>
T SquaredNorm(std::span<const T> x);

/// The constants of one step of Adam (Kingma and Ba, 2015, Algorithm 1), with both bias corrections
/// folded into step and epsilon, and of Polyak averaging.
template <typename T>
struct AdamConstants {
  T scale;          // of the gradient: below 1 if it is clipped
  T beta1, beta2;   // decay of the moments
  T step, epsilon;  // corrected step size and ε
  T tau;            // of Polyak averaging
};

/// In one pass, with g scaled: m ← β1 m + (1-β1) g, v ← β2 v + (1-β2) g²,
/// p ← p - step · m / (sqrt(v) + ε), target ← target + tau · (p - target) unless `target` is empty.
template <typename T>
void AdamPolyakStep(const AdamConstants<T>& constants, std::span<const T> g, std::span<T> m,
                    std::span<T> v, std::span<T> p, std::span<T> target);

}  // namespace upswing
