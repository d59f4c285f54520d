#pragma once

#include <span>

#include "core/matrix.h"

/// Kernels of small networks, for T = float and double. B = batch size.
/// This is the only file of the project that knows how they are made fast.
namespace upswing {

/// y (B × out) = x (B × in) · Wᵀ + b, with W (out × in) and b (out), as torch.nn.Linear has them.
template <typename T>
void LinearForward(Matrix<const T> x, Matrix<const T> w, std::span<const T> b, Matrix<T> y);

/// Gradients of LinearForward, given dy (B × out): writes dw (out × in), db (out) and, unless it
/// is empty, dx (B × in).
template <typename T>
void LinearBackward(Matrix<const T> x, Matrix<const T> w, Matrix<const T> dy, Matrix<T> dw,
                    std::span<T> db, Matrix<T> dx);

/// y = max(y, 0) in place.
template <typename T>
void ReluForward(Matrix<T> y);

/// dy = 0 where the output y of ReluForward is 0, in place.
template <typename T>
void ReluBackward(Matrix<const T> y, Matrix<T> dy);

/// y = gain · x̂ + bias with x̂ = (x - mean) / sqrt(var + 1e-5) over each row (Ba et al., 2016,
/// Eq 3). x (B × n) is replaced by x̂, and inv_std (B) = 1 / sqrt(var + 1e-5), for the way back.
template <typename T>
void LayerNormForward(Matrix<T> x, std::span<const T> gain, std::span<const T> bias,
                      std::span<T> inv_std, Matrix<T> y);

/// Gradients of LayerNormForward, given dy (B × n), x̂ and inv_std: writes dgain (n) and dbias (n)
/// and replaces dy by dx.
template <typename T>
void LayerNormBackward(Matrix<const T> x_hat, std::span<const T> gain, std::span<const T> inv_std,
                       std::span<T> dgain, std::span<T> dbias, Matrix<T> dy);

/// Sum of squares, summed in an order that depends on the size alone.
template <typename T>
T SquaredNorm(std::span<const T> x);

/// y += x.
template <typename T>
void AddTo(std::span<const T> x, std::span<T> y);

/// y += tau · (x - y): Polyak averaging.
template <typename T>
void MoveTowards(std::span<const T> x, T tau, std::span<T> y);

/// One step of Adam (Kingma and Ba, 2015, Algorithm 1) with gradient scale · g:
/// m ← β1 m + (1-β1) g, v ← β2 v + (1-β2) g², p ← p - step · m / (sqrt(v) + epsilon), where the
/// caller has put both bias corrections into step and epsilon.
template <typename T>
void AdamStep(std::span<const T> g, T scale, T beta1, T beta2, T step, T epsilon, std::span<T> m,
              std::span<T> v, std::span<T> p);

}  // namespace upswing
