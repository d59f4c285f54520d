#pragma once

#include <cstdint>
#include <span>

#include "core/aligned.h"
#include "core/matrix.h"
#include "core/rng.h"

/// The layers that networks are made of. B = batch size. T = float to work, double to check
/// gradients.
namespace upswing {

/// Some consecutive rows, of a batch or of a weight.
struct RowRange {
  int first, count;
};

/// The given rows of a matrix (… × cols) that begins where `values` does.
template <typename Values>
auto RowsOf(Values& values, RowRange rows, int cols) {
  return Matrix(std::span(values), rows.first + rows.count, cols).Rows(rows.first, rows.count);
}

/// Copies of the weights in the layouts that products read, each at its parameter's offset.
template <typename T>
struct Prepared {
  AlignedVector<T> transposed;  // (out × in), for the backward pass
};

/// Parameters and their prepared copies; a forward pass in float works without the copies.
template <typename T>
struct Weights {
  std::span<const T> parameters;
  const Prepared<T>* prepared = nullptr;
};

/// A place for the gradient with respect to some numbers x.
template <typename T>
struct GradientPlace {
  Matrix<T> dx;               // (B × n)
  Matrix<const T> gate = {};  // (B × n) dx = 0 where it is 0: x, if that is the output of a ReLU
};

enum class Activation { kNone, kRelu, kTanh };

struct LayerShape {
  int in, out;
  Activation activation = Activation::kNone;
  bool layer_norm = false;  // layer normalisation (Ba et al., 2016) before the activation
};

/// What forward and backward passes leave in each row of a batch.
template <typename T>
struct LayerActivations {
  AlignedVector<T> normal, inv_std;  // (B × out) x̂, (B); if layer_norm
  AlignedVector<T> output;           // (B × out)
  // Gradients (B × out) with respect to x · W + b and, if layer_norm, to what it makes of that.
  AlignedVector<T> grad_linear, grad_normal;
};

/// y (B × out) = activation(norm(x · W + b)), with x (B × in), W (in × out) and b (out), at its
/// place in a network's flat parameters. Immutable; a forward and a backward pass concern the given
/// rows of the batch.
template <typename T>
class Layer {
 public:
  /// W begins at `offset` of the parameters; b and, if layer_norm, gain and bias (out each) follow
  /// it.
  Layer(const LayerShape& shape, size_t offset);

  int in() const { return shape_.in; }
  int out() const { return shape_.out; }
  Matrix<const T> W(std::span<const T> parameters) const;
  std::span<const T> b(std::span<const T> parameters) const { return Vector(parameters, bias_); }

  /// PyTorch's defaults: W and b uniform in ±1/√in, gain 1 and its bias 0.
  void Initialize(Rng& rng, std::span<T> parameters) const;

  /// Buffers for up to `max_batch` rows; those of gradients only if asked for.
  LayerActivations<T> MakeActivations(int max_batch, bool gradients) const;

  /// Writes the copies of some rows of W.
  void Prepare(RowRange rows, std::span<const T> parameters, Prepared<T>& prepared) const;

  /// Returns y, given x (rows.count × in).
  Matrix<const T> Forward(Weights<T> weights, Matrix<const T> x, RowRange rows,
                          LayerActivations<T>& a) const;

  /// The y of the last Forward.
  Matrix<const T> Output(RowRange rows, const LayerActivations<T>& a) const;
  /// Where to put the gradient with respect to y before Backward.
  GradientPlace<T> OutputGradient(RowRange rows, LayerActivations<T>& a) const;

  /// Writes the gradients with respect to x · W + b and to x, where there is a place for the
  /// latter.
  void Backward(Weights<T> weights, RowRange rows, LayerActivations<T>& a,
                GradientPlace<T> input) const;

  /// Writes the gradient with respect to some rows of W, and with the first rows to all vectors,
  /// into its place in `gradient`: the sum over all rows of x (B × in). Returns the sum of its
  /// squares.
  T BackwardWeights(RowRange rows, Matrix<const T> x, const LayerActivations<T>& a,
                    std::span<T> gradient) const;

 private:
  /// y = x · W + b; y = max(y, 0) if `relu`.
  void Multiply(Weights<T> weights, Matrix<const T> x, bool relu, Matrix<T> y) const;
  /// dx = dy · Wᵀ.
  void MultiplyTransposed(Weights<T> weights, Matrix<const T> dy, GradientPlace<T> input) const;
  template <typename Parameter>
  std::span<Parameter> Vector(std::span<Parameter> parameters, size_t offset) const {
    return parameters.subspan(offset, static_cast<size_t>(shape_.out));
  }

  LayerShape shape_;
  size_t weight_, bias_, gain_, norm_bias_;  // offsets
};

extern template class Layer<float>;
extern template class Layer<double>;

}  // namespace upswing
