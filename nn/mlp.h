#pragma once

#include <cstdint>
#include <vector>

#include "nn/parameter_layout.h"

namespace upswing {

/// The shape of a multi-layer perceptron.
struct MlpShape {
  static constexpr int64_t kMaxWidth = 4096;  // units of a layer, inputs, outputs of a head
  static constexpr size_t kMaxLayers = 16;

  int inputs = 0;               // D
  std::vector<int64_t> hidden;  // widths of the layers
  bool layer_norm = false;      // layer normalisation between each layer and its activation
  Activation activation = Activation::kRelu;
};

/// The trunk of a network: layers from inputs to features, D → hidden… . B = batch size, D = number
/// of inputs, H = number of features. nn/network.h makes a network of it and a head, and explains
/// the passes.
template <typename T>
class Mlp {
 public:
  /// Adds the layers "feature.0", … to `layout`. The sizes are valid: Network has checked them.
  Mlp(const MlpShape& shape, ParameterLayout<T>& layout);

  size_t num_layers() const { return layers_.size(); }
  int width() const { return layers_.back().out(); }     // H
  using Activations = std::vector<LayerActivations<T>>;  // by layer

  /// Returns the features (rows.count × H) of the given rows of the inputs x (B × D).
  Matrix<const T> Forward(Weights<T> weights, Matrix<const T> x, RowRange rows,
                          Activations& a) const;

  /// The features of the last Forward.
  Matrix<const T> Features(RowRange rows, const Activations& a) const {
    return layers_.back().Output(rows, a.back());
  }
  /// Where to put the gradient with respect to them before Backward.
  GradientPlace<T> FeatureGradient(RowRange rows, Activations& a) const {
    return layers_.back().OutputGradient(rows, a.back());
  }

  /// Writes the gradients of all activations, and if there is a dx (B × D) of the inputs.
  void Backward(Weights<T> weights, RowRange rows, Activations& a, Matrix<T> dx) const;

  /// Layer::BackwardWeights, given the inputs x (B × D).
  T BackwardWeights(size_t layer, RowRange rows, Matrix<const T> x, const Activations& a,
                    std::span<T> gradient) const;

 private:
  std::vector<Layer<T>> layers_;
};

extern template class Mlp<float>;
extern template class Mlp<double>;

}  // namespace upswing
