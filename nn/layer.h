#pragma once

#include <algorithm>
#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "core/aligned.h"
#include "core/matrix.h"
#include "core/rng.h"
#include "nn/real.h"

/// The layers that networks are made of. B = batch size.
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

/// A place for the gradient with respect to some numbers x.
struct GradientPlace {
  Matrix<Real> dx;               // (B × n)
  Matrix<const Real> gate = {};  // (B × n) dx = 0 where it is 0: x, if that is a ReLU's output
};

enum class Activation { kNone, kRelu, kTanh };

/// A named parameter array within a network's flat parameters.
struct ParameterBlock {
  std::string name;  // such as "feature.0.weight"
  size_t offset;     // first number
  int in, out;       // a weight is (in × out); in is 0 for a vector of `out` numbers
  size_t size() const { return static_cast<size_t>(std::max(1, in)) * static_cast<size_t>(out); }
};

/// Units of a layer with their numbers, for those that write a network in another form.
struct LayerView {
  std::string name;      // such as "feature.0"
  Matrix<const Real> W;  // (in × out)
  std::span<const Real> b, gain,
      norm_bias;  // (out); without layer normalisation the last are empty
  Activation activation;

  int in() const { return W.rows(); }
  int out() const { return W.cols(); }
  bool layer_norm() const { return !gain.empty(); }
  /// Some consecutive units of a layer without layer normalisation.
  LayerView Units(int first, int count) const;
};

/// What forward and backward passes leave in each row of a batch.
struct LayerActivations {
  AlignedVector<Real> normal, inv_std;  // (B × out) x̂, (B); if layer_norm
  AlignedVector<Real> output;           // (B × out)
  // Gradients (B × out) with respect to x · W + b and, if layer_norm, to what it makes of that.
  AlignedVector<Real> grad_linear, grad_normal;
};

/// y (B × out) = activation(norm(x · W + b)), with x (B × in), W (in × out) and b (out), at its
/// place in a network's flat parameters. Immutable; a forward and a backward pass concern the given
/// rows of the batch.
class Layer {
 public:
  /// W begins at `offset` of the parameters; b and, with layer normalisation (Ba et al., 2016)
  /// before the activation, gain and bias (out each) follow it.
  Layer(std::string name, int in, int out, Activation activation, bool layer_norm, size_t offset);

  int in() const { return in_; }
  int out() const { return out_; }
  /// NAME.weight, NAME.bias and, with layer normalisation, NAME.norm.weight and NAME.norm.bias.
  std::vector<ParameterBlock> Blocks() const;
  LayerView View(std::span<const Real> parameters) const;

  /// PyTorch's defaults: W and b uniform in ±1/√in, gain 1 and its bias 0.
  void Initialize(Rng& rng, std::span<Real> parameters) const;

  /// b (out).
  std::span<Real> Bias(std::span<Real> parameters) const { return Vector(parameters, bias_); }

  /// Buffers for up to `max_batch` rows; those of gradients only if asked for.
  LayerActivations MakeActivations(int max_batch, bool gradients) const;

  /// Returns y, given x (rows.count × in).
  Matrix<const Real> Forward(std::span<const Real> parameters, Matrix<const Real> x, RowRange rows,
                             LayerActivations& a) const;

  /// The y of the last Forward.
  Matrix<const Real> Output(RowRange rows, const LayerActivations& a) const;
  /// Where to put the gradient with respect to y before Backward.
  GradientPlace OutputGradient(RowRange rows, LayerActivations& a) const;

  /// Writes some rows of W, transposed (out × in), into their place in `transposed`, which has W at
  /// the offset of `parameters`.
  void TransposeWeights(RowRange rows, std::span<const Real> parameters,
                        std::span<Real> transposed) const;

  /// Writes the gradients with respect to x · W + b and to x, where there is a place for the
  /// latter, given all that TransposeWeights writes.
  void Backward(std::span<const Real> parameters, std::span<const Real> transposed, RowRange rows,
                LayerActivations& a, GradientPlace input) const;

  /// Writes the gradient with respect to some rows of W, and with the first rows to all vectors,
  /// into its place in `gradient`: the sum over all rows of x (B × in). Returns the sum of its
  /// squares.
  Real BackwardWeights(RowRange rows, Matrix<const Real> x, const LayerActivations& a,
                       std::span<Real> gradient) const;

 private:
  /// The vector (out) at this offset.
  template <typename Parameter>
  std::span<Parameter> Vector(std::span<Parameter> parameters, size_t offset) const {
    return parameters.subspan(offset, out_);
  }

  std::string name_;
  int in_, out_;
  Activation activation_;
  bool layer_norm_;
  size_t weight_, bias_, gain_, norm_bias_;  // offsets
};

}  // namespace upswing
