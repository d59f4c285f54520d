#include "nn/layer.h"

#include <algorithm>
#include <cmath>

#include "nn/linear.h"

namespace upswing {

template <typename T>
Layer<T>::Layer(const LayerShape& shape, size_t offset)
    : shape_(shape),
      weight_(offset),
      bias_(weight_ + static_cast<size_t>(shape.in) * static_cast<size_t>(shape.out)),
      gain_(bias_ + static_cast<size_t>(shape.out)),
      norm_bias_(gain_ + static_cast<size_t>(shape.out)) {}

template <typename T>
Matrix<const T> Layer<T>::W(std::span<const T> parameters) const {
  return {parameters.data() + weight_, in(), out()};
}

template <typename T>
void Layer<T>::Initialize(Rng& rng, std::span<T> parameters) const {
  const double bound = 1.0 / std::sqrt(in());
  for (T& p : parameters.subspan(weight_, gain_ - weight_)) {
    p = static_cast<T>(rng.Uniform(-bound, bound));
  }
  if (!shape_.layer_norm) return;
  std::ranges::fill(Vector(parameters, gain_), T{1});
  std::ranges::fill(Vector(parameters, norm_bias_), T{0});
}

template <typename T>
LayerActivations<T> Layer<T>::MakeActivations(int max_batch, bool gradients) const {
  const auto rows = static_cast<size_t>(max_batch);
  const size_t numbers = rows * static_cast<size_t>(out());
  LayerActivations<T> a;
  a.output.resize(numbers);
  if (gradients) a.grad_linear.resize(numbers);
  if (!shape_.layer_norm) return a;
  a.normal.resize(numbers);
  a.inv_std.resize(rows);
  if (gradients) a.grad_normal.resize(numbers);
  return a;
}

template <typename T>
void Layer<T>::Prepare(RowRange rows, std::span<const T> parameters, Prepared<T>& prepared) const {
  const auto [first, count] = rows;
  const Matrix<T> transposed(prepared.transposed.data() + weight_, out(), in());
  Transpose(W(parameters).Rows(first, count), transposed.Cols(first, count));
}

template <typename T>
void Layer<T>::Multiply(Weights<T> weights, Matrix<const T> x, bool relu, Matrix<T> y) const {
  const std::span<const T> bias = b(weights.parameters);
  LinearForward(x, W(weights.parameters), bias, relu, y);
}

template <typename T>
void Layer<T>::MultiplyTransposed(Weights<T> weights, Matrix<const T> dy,
                                  GradientPlace<T> input) const {
  const T* transposed = weights.prepared->transposed.data() + weight_;
  LinearBackwardInput(dy, Matrix<const T>(transposed, out(), in()), input.gate, input.dx);
}

template <typename T>
Matrix<const T> Layer<T>::Forward(Weights<T> weights, Matrix<const T> x, RowRange rows,
                                  LayerActivations<T>& a) const {
  const bool relu = shape_.activation == Activation::kRelu;
  const Matrix<T> y = RowsOf(a.output, rows, out());
  if (shape_.layer_norm) {
    const Matrix<T> normal = RowsOf(a.normal, rows, out());
    Multiply(weights, x, false, normal);
    LayerNormForward(normal, Vector(weights.parameters, gain_),
                     Vector(weights.parameters, norm_bias_), RowsOf(a.inv_std, rows, 1).values(),
                     relu, y);
  } else {
    Multiply(weights, x, relu, y);
  }
  if (shape_.activation == Activation::kTanh) Tanh(y.values());
  return y;
}

template <typename T>
Matrix<const T> Layer<T>::Output(RowRange rows, const LayerActivations<T>& a) const {
  return RowsOf(a.output, rows, out());
}

template <typename T>
GradientPlace<T> Layer<T>::OutputGradient(RowRange rows, LayerActivations<T>& a) const {
  const Matrix<T> dy = RowsOf(shape_.layer_norm ? a.grad_normal : a.grad_linear, rows, out());
  if (shape_.activation != Activation::kRelu) return {dy};
  return {dy, Output(rows, a)};
}

template <typename T>
void Layer<T>::Backward(Weights<T> weights, RowRange rows, LayerActivations<T>& a,
                        GradientPlace<T> input) const {
  // dy: with respect to y; for a ReLU already to what is before it, because of the gate.
  const Matrix<T> dy = OutputGradient(rows, a).dx;
  const Matrix<T> dlinear = RowsOf(a.grad_linear, rows, out());
  if (shape_.activation == Activation::kTanh) TanhBackward(Output(rows, a).values(), dy.values());
  if (shape_.layer_norm) {
    const Matrix<const T> x_hat = RowsOf(a.normal, rows, out());
    const std::span<const T> inv_std = RowsOf(a.inv_std, rows, 1).values();
    LayerNormBackwardInput<T>(x_hat, Vector(weights.parameters, gain_), inv_std, dy, dlinear);
  }
  if (!input.dx.empty()) MultiplyTransposed(weights, dlinear, input);
}

template <typename T>
T Layer<T>::BackwardWeights(RowRange rows, Matrix<const T> x, const LayerActivations<T>& a,
                            std::span<T> gradient) const {
  const RowRange all{0, x.rows()};
  const Matrix<const T> dlinear = RowsOf(a.grad_linear, all, out());
  const Matrix<const T> columns = x.Cols(rows.first, rows.count);
  const Matrix<T> dw =
      Matrix<T>(gradient.data() + weight_, in(), out()).Rows(rows.first, rows.count);
  LinearBackwardWeight(columns, dlinear, dw);
  T squares = SquaredNorm<T>(dw.values());
  if (rows.first > 0) return squares;

  const std::span<T> db = Vector(gradient, bias_);
  SumRows(dlinear, db);
  squares += SquaredNorm<T>(db);
  if (!shape_.layer_norm) return squares;
  const Matrix<const T> dnormal = RowsOf(a.grad_normal, all, out());
  const std::span<T> dgain = Vector(gradient, gain_);
  const std::span<T> dnorm_bias = Vector(gradient, norm_bias_);
  LayerNormBackwardGain<T>(RowsOf(a.normal, all, out()), dnormal, dgain);
  SumRows(dnormal, dnorm_bias);
  return squares + (SquaredNorm<T>(dgain) + SquaredNorm<T>(dnorm_bias));
}

template class Layer<float>;
template class Layer<double>;

}  // namespace upswing
