#pragma once

#include <algorithm>
#include <span>
#include <string>
#include <vector>

#include "base/aligned.h"
#include "base/matrix.h"
#include "base/rng.h"
#include "nn/real.h"

/// Layers of networks. B = batch size.
namespace upswing {

/// Consecutive rows of a batch or of a weight.
struct RowRange {
  int first, count;
};

/// View of some rows of a matrix (… × cols) whose first number is the first of `values`.
template <typename Values>
auto RowsOf(Values& values, RowRange rows, int cols) {
  return Matrix(std::span(values), rows.first + rows.count, cols).Rows(rows.first, rows.count);
}

/// Destination of the gradient with respect to some numbers x.
struct GradientPlace {
  Matrix<Real> dx;               // (B × n)
  Matrix<const Real> gate = {};  // (B × n) x if it is the output of a ReLU: dx = 0 where gate = 0
};

enum class Activation { kNone, kRelu, kTanh };

/// A named parameter array within a network's flat parameters.
struct ParameterBlock {
  std::string name;  // such as "feature.0.weight"
  size_t offset;     // first number
  int in, out;       // a weight is (in × out); a vector of `out` numbers has in = 0
  size_t size() const { return static_cast<size_t>(std::max(1, in)) * static_cast<size_t>(out); }
};

/// A view of a layer's units and parameters, for writers of other network formats.
struct LayerView {
  std::string name;      // such as "feature.0"
  Matrix<const Real> W;  // (in × out)
  std::span<const Real> b, gain,
      norm_bias;  // (out); gain and norm_bias are empty without layer normalisation
  Activation activation;

  int in() const { return W.rows(); }
  int out() const { return W.cols(); }
  bool layer_norm() const { return !gain.empty(); }
  /// View of consecutive units. The layer must not have layer normalisation.
  LayerView Units(int first, int count) const;
};

/// Results of forward and backward passes, per row of a batch.
struct LayerActivations {
  AlignedVector<Real> normal, inv_std;  // x̂ (B × out) and its factor (B); only with layer_norm
  AlignedVector<Real> output;           // (B × out)
  // Gradients (B × out) with respect to x · W + b and, with layer_norm, to the output of the
  // normalisation.
  AlignedVector<Real> grad_linear, grad_normal;
};

/// y (B × out) = activation(norm(x · W + b)), with x (B × in), W (in × out) and b (out). The layer
/// has its place in a network's flat parameters. Immutable. Forward and Backward process only the
/// given rows of the batch.
class Layer {
 public:
  /// W begins at `offset` of the parameters, and b follows. With layer normalisation (Ba et al.,
  /// 2016), which precedes the activation, its gain and bias (out each) follow b.
  Layer(std::string name, int in, int out, Activation activation, bool layer_norm, size_t offset);

  int in() const { return in_; }
  int out() const { return out_; }
  /// NAME.weight, NAME.bias and, with layer normalisation, NAME.norm.weight and NAME.norm.bias.
  std::vector<ParameterBlock> Blocks() const;
  LayerView View(std::span<const Real> parameters) const;

  /// Sets PyTorch's defaults: W and b uniform in ±1/√in, gain 1 and norm bias 0.
  void Initialize(Rng& rng, std::span<Real> parameters) const;

  /// View of b (out).
  std::span<Real> Bias(std::span<Real> parameters) const { return Vector(parameters, bias_); }

  /// Makes buffers for up to `max_batch` rows. They include gradients only if `gradients`.
  LayerActivations MakeActivations(int max_batch, bool gradients) const;

  /// Computes and returns y (rows.count × out) for x (rows.count × in).
  Matrix<const Real> Forward(std::span<const Real> parameters, Matrix<const Real> x, RowRange rows,
                             LayerActivations& a) const;

  /// The y (rows.count × out) of the last Forward.
  Matrix<const Real> Output(RowRange rows, const LayerActivations& a) const;
  /// Destination of the gradient with respect to y. Fill it before Backward.
  GradientPlace OutputGradient(RowRange rows, LayerActivations& a) const;

  /// Transposes some rows of W into `transposed`. Wᵀ (out × in) begins there at the offset that W
  /// has in `parameters`.
  void TransposeWeights(RowRange rows, std::span<const Real> parameters,
                        std::span<Real> transposed) const;

  /// Writes the gradient with respect to x · W + b, and with respect to x if `input` has a
  /// destination for it. It needs the transposed weights of all rows of W.
  void Backward(std::span<const Real> parameters, std::span<const Real> transposed, RowRange rows,
                LayerActivations& a, GradientPlace input) const;

  /// Writes the gradient with respect to some rows of W, summed over all rows of x (B × in), to its
  /// place in `gradient`. The call for the first rows also writes the gradients of all vectors.
  /// Returns the sum of squares of the written numbers.
  Real BackwardWeights(RowRange rows, Matrix<const Real> x, const LayerActivations& a,
                       std::span<Real> gradient) const;

 private:
  /// View of the vector (out) at `offset`.
  template <typename Parameter>
  std::span<Parameter> Vector(std::span<Parameter> parameters, size_t offset) const {
    return parameters.subspan(offset, out_);
  }

  std::string name_;
  int in_, out_;
  Activation activation_;
  bool layer_norm_;
  size_t weight_, bias_, gain_, norm_bias_;  // offsets in the parameters
};

}  // namespace upswing
