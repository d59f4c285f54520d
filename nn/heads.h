#pragma once

#include <algorithm>
#include <cstdint>
#include <variant>
#include <vector>

#include "nn/parameter_layout.h"

/// Heads: what makes a network's outputs y (B × A) of its features x (B × H). B = batch size, A =
/// number of outputs. What an algorithm takes the outputs for (Q-values, a value, logits, mean and
/// log standard deviation) is its own matter.
///
/// Forward writes y. Backward writes the gradient with respect to x, given that with respect to y,
/// dy (B × A). BackwardWeights is Layer::BackwardWeights, given the features of the whole batch;
/// everywhere else, x, y and dy are the given rows alone.
namespace upswing {

/// The shape of a head.
struct HeadShape {
  int outputs = 0;      // A
  int64_t streams = 0;  // width of each stream's hidden layer if dueling; 0: one linear layer
};

/// y = x · W + b.
template <typename T>
class LinearHead {
 public:
  using Activations = std::vector<LayerActivations<T>>;  // by layer

  /// Adds the layer "output".
  LinearHead(int features, const HeadShape& shape, ParameterLayout<T>& layout)
      : output_(layout.Add("output", {features, shape.outputs})) {}

  void Forward(Weights<T> weights, Matrix<const T> x, RowRange rows, Activations& a,
               Matrix<T> y) const {
    std::ranges::copy(output_.Forward(weights, x, rows, a[0]).values(), y.values().begin());
  }
  void Backward(Weights<T> weights, Matrix<const T> dy, RowRange rows, Activations& a,
                GradientPlace<T> input) const {
    std::ranges::copy(dy.values(), output_.OutputGradient(rows, a[0]).dx.values().begin());
    output_.Backward(weights, rows, a[0], input);
  }
  T BackwardWeights(size_t /*layer*/, RowRange rows, Matrix<const T> x, const Activations& a,
                    std::span<T> gradient) const {
    return output_.BackwardWeights(rows, x, a[0], gradient);
  }

 private:
  Layer<T> output_;
};

/// y = V + A - mean(A) (Wang et al., 2016, Eq 9), from two streams with a hidden layer of G units
/// each: H → { G → 1, G → A }. The two hidden layers are one matrix (H × 2G): value first, then
/// advantage.
template <typename T>
class DuelingHead {
 public:
  using Activations = std::vector<LayerActivations<T>>;  // by layer

  /// Adds the layers "streams", "value" and "advantage".
  DuelingHead(int features, const HeadShape& shape, ParameterLayout<T>& layout);

  void Forward(Weights<T> weights, Matrix<const T> x, RowRange rows, Activations& a,
               Matrix<T> y) const;
  /// Writes the advantages A (B × A), without the value stream: their argmax is that of y.
  void ForwardAdvantages(std::span<const T> parameters, Matrix<const T> x, RowRange rows,
                         Activations& a, Matrix<T> advantages) const;
  void Backward(Weights<T> weights, Matrix<const T> dy, RowRange rows, Activations& a,
                GradientPlace<T> input) const;
  T BackwardWeights(size_t layer, RowRange rows, Matrix<const T> x, const Activations& a,
                    std::span<T> gradient) const;

 private:
  int width_;  // G
  Layer<T> streams_, value_, advantage_;
};

template <typename T>
using Head = std::variant<LinearHead<T>, DuelingHead<T>>;

extern template class DuelingHead<float>;
extern template class DuelingHead<double>;

}  // namespace upswing
