#pragma once

#include <limits>
#include <span>

#include "base/matrix.h"
#include "nn/real.h"

/// Kernels for small networks. B = batch size.
///
/// Every kernel is compiled for several instruction sets (base/simd.h). Only linear.cc and
/// product.cc contain vector code.
///
/// The order of each sum depends only on the sizes, not on a row's position in the batch. Splitting
/// a batch into slices therefore changes no bit.
namespace upswing {

/// y (B × out) = x (B × in) · W + b, with W (in × out) and b (out); y = max(y, 0) if `relu`.
/// W is the transpose of torch.nn.Linear's.
void LinearForward(Matrix<const Real> x, Matrix<const Real> w, std::span<const Real> b, bool relu,
                   Matrix<Real> y);

/// dx (B × in) = dy (B × out) · Wᵀ, given Wᵀ (out × in). If x is the output of a ReLU, pass it as
/// `gate` (B × in): dx = 0 where x is 0. Otherwise `gate` is empty.
void LinearBackwardInput(Matrix<const Real> dy, Matrix<const Real> w_transposed,
                         Matrix<const Real> gate, Matrix<Real> dx);

/// dW (in × out) = xᵀ (in × B) · dy (B × out). db (out) = the sum of the rows of dy, unless it is
/// empty.
void LinearBackwardWeight(Matrix<const Real> x, Matrix<const Real> dy, Matrix<Real> dw,
                          std::span<Real> db = {});

/// sum (n) of the rows of x (B × n).
void SumRows(Matrix<const Real> x, std::span<Real> sum);

/// y (cols × rows) = the transpose of x (rows × cols).
void Transpose(Matrix<const Real> x, Matrix<Real> y);

/// y = gain · x̂ + bias with x̂ = (x - mean) / sqrt(var + 1e-5) over each row (Ba et al., 2016, Eq
/// 3); y = max(y, 0) if `relu`. For the backward pass, x̂ replaces x (B × n), and inv_std (B)
/// receives 1 / sqrt(var + 1e-5).
void LayerNormForward(Matrix<Real> x, std::span<const Real> gain, std::span<const Real> bias,
                      std::span<Real> inv_std, bool relu, Matrix<Real> y);

/// dx (B × n) of layer normalisation, given x̂, inv_std and dy (B × n), the gradient before the
/// ReLU.
void LayerNormBackwardInput(Matrix<const Real> x_hat, std::span<const Real> gain,
                            std::span<const Real> inv_std, Matrix<const Real> dy, Matrix<Real> dx);

/// dgain (n) = Σ dy · x̂ over the rows. The gradient of the bias is SumRows(dy).
void LayerNormBackwardGain(Matrix<const Real> x_hat, Matrix<const Real> dy, std::span<Real> dgain);

/// x = tanh(x), with an error of up to 4 units in the last place.
void Tanh(std::span<Real> x);

/// Backward pass of tanh: dy = dy · (1 - y²), where y = tanh(x).
void TanhBackward(std::span<const Real> y, std::span<Real> dy);

/// Samples n components of squashed Gaussians (nn/gaussian.h). Inputs: mean, log_std (within its
/// range) and epsilon. Outputs: deviation = exp(log_std), action = tanh(mean + deviation · epsilon)
/// and the log-probability of each. They equal Squash up to some units in the last place.
void SquashSamples(std::span<const Real> mean, std::span<const Real> log_std,
                   std::span<const Real> epsilon, std::span<Real> deviation, std::span<Real> action,
                   std::span<Real> log_prob);

/// Sum of the squares of x.
Real SquaredNorm(std::span<const Real> x);

/// Constants of one step of Adam (Kingma and Ba, 2015, Algorithm 1) and of Polyak averaging. Both
/// bias corrections are in `step` and `epsilon`.
struct AdamConstants {
  Real scale;          // factor of the gradient: below 1 if it is clipped
  Real beta1, beta2;   // decay of the moments
  Real step, epsilon;  // corrected step size and ε
  Real tau;            // rate of Polyak averaging
};

/// Smaller moments become 0. Without gradients, as behind a unit that is never active, the moments
/// would decay into subnormal numbers, stay there by rounding, and make each step several times as
/// slow. Their product with a step size is still a normal number.
inline constexpr Real kLeastMoment =
    std::numeric_limits<Real>::min() / std::numeric_limits<Real>::epsilon();

/// One pass, with the scaled gradient g: m ← β1 m + (1-β1) g, v ← β2 v + (1-β2) g²,
/// p ← p - step · m / (sqrt(v) + ε), target ← target + tau · (p - target) unless `target` is empty.
void AdamPolyakStep(const AdamConstants& constants, std::span<const Real> g, std::span<Real> m,
                    std::span<Real> v, std::span<Real> p, std::span<Real> target);

}  // namespace upswing
