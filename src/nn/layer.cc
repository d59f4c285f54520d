#include "nn/layer.h"

#include <cmath>

#include "nn/linear.h"

namespace upswing {

LayerView LayerView::Units(int first, int count) const {
  return {name, W.Cols(first, count), b.subspan(first, count), {}, {}, activation};
}

Layer::Layer(std::string name, int in, int out, Activation activation, bool layer_norm,
             size_t offset)
    : name_(std::move(name)),
      in_(in),
      out_(out),
      activation_(activation),
      layer_norm_(layer_norm),
      weight_(offset),
      bias_(weight_ + in * out),
      gain_(bias_ + out),
      norm_bias_(gain_ + out) {}

std::vector<ParameterBlock> Layer::Blocks() const {
  std::vector<ParameterBlock> blocks{{name_ + ".weight", weight_, in_, out_},
                                     {name_ + ".bias", bias_, 0, out_}};
  if (layer_norm_) {
    blocks.push_back({name_ + ".norm.weight", gain_, 0, out_});
    blocks.push_back({name_ + ".norm.bias", norm_bias_, 0, out_});
  }
  return blocks;
}

LayerView Layer::View(std::span<const Real> parameters) const {
  LayerView view{
      name_,      {parameters.data() + weight_, in_, out_}, Vector(parameters, bias_), {}, {},
      activation_};
  if (!layer_norm_) return view;
  view.gain = Vector(parameters, gain_);
  view.norm_bias = Vector(parameters, norm_bias_);
  return view;
}

void Layer::Initialize(Rng& rng, std::span<Real> parameters) const {
  const double bound = 1.0 / std::sqrt(in_);
  for (Real& p : parameters.subspan(weight_, gain_ - weight_)) {
    p = static_cast<Real>(rng.Uniform(-bound, bound));
  }
  if (!layer_norm_) return;
  std::ranges::fill(Vector(parameters, gain_), Real{1});
  std::ranges::fill(Vector(parameters, norm_bias_), Real{0});
}

LayerActivations Layer::MakeActivations(int max_batch, bool gradients) const {
  const auto rows = static_cast<size_t>(max_batch);
  const size_t numbers = rows * static_cast<size_t>(out_);
  LayerActivations a;
  a.output.resize(numbers);
  if (gradients) a.grad_linear.resize(numbers);
  if (!layer_norm_) return a;
  a.normal.resize(numbers);
  a.inv_std.resize(rows);
  if (gradients) a.grad_normal.resize(numbers);
  return a;
}

Matrix<const Real> Layer::Forward(std::span<const Real> parameters, Matrix<const Real> x,
                                  RowRange rows, LayerActivations& a) const {
  const bool relu = activation_ == Activation::kRelu;
  const Matrix<const Real> W(parameters.data() + weight_, in_, out_);
  const std::span<const Real> b = Vector(parameters, bias_);
  const Matrix<Real> y = RowsOf(a.output, rows, out_);
  if (layer_norm_) {
    const Matrix<Real> normal = RowsOf(a.normal, rows, out_);
    LinearForward(x, W, b, false, normal);
    LayerNormForward(normal, Vector(parameters, gain_), Vector(parameters, norm_bias_),
                     RowsOf(a.inv_std, rows, 1).values(), relu, y);
  } else {
    LinearForward(x, W, b, relu, y);
  }
  if (activation_ == Activation::kTanh) Tanh(y.values());
  return y;
}

Matrix<const Real> Layer::Output(RowRange rows, const LayerActivations& a) const {
  return RowsOf(a.output, rows, out_);
}

GradientPlace Layer::OutputGradient(RowRange rows, LayerActivations& a) const {
  const Matrix<Real> dy = RowsOf(layer_norm_ ? a.grad_normal : a.grad_linear, rows, out_);
  if (activation_ != Activation::kRelu) return {dy};
  return {dy, Output(rows, a)};
}

void Layer::TransposeWeights(RowRange rows, std::span<const Real> parameters,
                             std::span<Real> transposed) const {
  const Matrix<const Real> W(parameters.data() + weight_, in_, out_);
  const Matrix<Real> W_transposed(transposed.data() + weight_, out_, in_);
  Transpose(W.Rows(rows.first, rows.count), W_transposed.Cols(rows.first, rows.count));
}

void Layer::Backward(std::span<const Real> parameters, std::span<const Real> transposed,
                     RowRange rows, LayerActivations& a, GradientPlace input) const {
  // Gradient with respect to y. For a ReLU, the gate has made it the gradient before the ReLU.
  const Matrix<Real> dy = OutputGradient(rows, a).dx;
  const Matrix<Real> dlinear = RowsOf(a.grad_linear, rows, out_);
  if (activation_ == Activation::kTanh) TanhBackward(Output(rows, a).values(), dy.values());
  if (layer_norm_) {
    LayerNormBackwardInput(RowsOf(a.normal, rows, out_), Vector(parameters, gain_),
                           RowsOf(a.inv_std, rows, 1).values(), dy, dlinear);
  }
  if (input.dx.empty()) return;
  const Matrix<const Real> W_transposed(transposed.data() + weight_, out_, in_);
  LinearBackwardInput(dlinear, W_transposed, input.gate, input.dx);
}

Real Layer::BackwardWeights(RowRange rows, Matrix<const Real> x, const LayerActivations& a,
                            std::span<Real> gradient) const {
  const RowRange all{0, x.rows()};
  const Matrix<const Real> dlinear = RowsOf(a.grad_linear, all, out_);
  const Matrix<Real> dW =
      Matrix<Real>(gradient.data() + weight_, in_, out_).Rows(rows.first, rows.count);
  const std::span<Real> db = rows.first == 0 ? Vector(gradient, bias_) : std::span<Real>();
  LinearBackwardWeight(x.Cols(rows.first, rows.count), dlinear, dW, db);
  Real squares = SquaredNorm(dW.values());
  if (db.empty()) return squares;
  squares += SquaredNorm(db);
  if (!layer_norm_) return squares;
  const Matrix<const Real> dnormal = RowsOf(a.grad_normal, all, out_);
  const std::span<Real> dgain = Vector(gradient, gain_);
  const std::span<Real> dnorm_bias = Vector(gradient, norm_bias_);
  LayerNormBackwardGain(RowsOf(a.normal, all, out_), dnormal, dgain);
  SumRows(dnormal, dnorm_bias);
  return squares + (SquaredNorm(dgain) + SquaredNorm(dnorm_bias));
}

}  // namespace upswing
