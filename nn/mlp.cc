#include "nn/mlp.h"

#include "core/text.h"

namespace upswing {

template <typename T>
Mlp<T>::Mlp(const MlpShape& shape, ParameterLayout<T>& layout) {
  int in = shape.inputs;
  for (const int64_t width : shape.hidden) {
    const int out = static_cast<int>(width);
    const std::string name = Concat("feature.", layers_.size());
    layers_.push_back(layout.Add(name, {in, out, shape.activation, shape.layer_norm}));
    in = out;
  }
}

template <typename T>
Matrix<const T> Mlp<T>::Forward(Weights<T> weights, Matrix<const T> x, RowRange rows,
                                Activations& a) const {
  Matrix<const T> y = x.Rows(rows.first, rows.count);
  for (size_t i = 0; i < layers_.size(); ++i) y = layers_[i].Forward(weights, y, rows, a[i]);
  return y;
}

template <typename T>
void Mlp<T>::Backward(Weights<T> weights, RowRange rows, Activations& a, Matrix<T> dx) const {
  for (size_t i = layers_.size(); --i > 0;) {
    layers_[i].Backward(weights, rows, a[i], layers_[i - 1].OutputGradient(rows, a[i - 1]));
  }
  const Matrix<T> dx_rows = dx.empty() ? dx : dx.Rows(rows.first, rows.count);
  layers_[0].Backward(weights, rows, a[0], {dx_rows});
}

template <typename T>
T Mlp<T>::BackwardWeights(size_t layer, RowRange rows, Matrix<const T> x, const Activations& a,
                          std::span<T> gradient) const {
  const Matrix<const T> input =
      layer == 0 ? x : layers_[layer - 1].Output({0, x.rows()}, a[layer - 1]);
  return layers_[layer].BackwardWeights(rows, input, a[layer], gradient);
}

template class Mlp<float>;
template class Mlp<double>;

}  // namespace upswing
