#pragma once

#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "nn/layer.h"

namespace upswing {

/// The shape of a network: D → hidden… → A, or dueling, D → hidden… → { streams → 1, streams → A }.
struct NetworkShape {
  /// Largest number of units in a layer, of inputs and of outputs.
  static constexpr int64_t kMaxWidth = 4096;
  static constexpr size_t kMaxLayers = 16;  // largest number of hidden layers

  int inputs = 0;               // D
  std::vector<int64_t> hidden;  // widths of the hidden layers
  int outputs = 0;              // A
  bool layer_norm = false;  // whether hidden layers have layer normalisation before the activation
  Activation activation = Activation::kRelu;
  int64_t streams = 0;  // width of the hidden layer of each dueling stream; 0: not dueling

  bool dueling() const { return streams != 0; }
  /// The shape as text, such as "8-64-64-9", or "8-64-(32→1, 32→9)" for a dueling network.
  std::string Text() const;
  bool operator==(const NetworkShape&) const = default;
};

/// A network from inputs x (B × D) to outputs y (B × A) with one flat array of parameters. It has
/// hidden layers ("feature.0", …) and a linear layer ("output").
///
/// A dueling network has y = V + A - mean(A) (Wang et al., 2016, Eq 9) in place of the linear
/// layer. Its layer "streams" holds the hidden layers of both streams, with G units each, as one
/// matrix (H × 2G), value first. The layers "value" (G → 1) and "advantage" (G → A) follow.
///
/// Immutable: parameters, gradients and activations belong to the caller. One network can serve
/// several sets of parameters and any number of threads.
///
/// A gradient takes three steps that threads can share: TransposeWeights for all tasks; Forward and
/// BackwardInputs for slices of the batch; BackwardWeights for all tasks. The result has the same
/// bits for any number of threads. Backward runs all three steps. The gradient with respect to the
/// inputs does not need BackwardWeights.
class Network {
 public:
  /// Throws BadInput if a size is invalid.
  explicit Network(NetworkShape shape);

  const NetworkShape& shape() const { return shape_; }
  size_t num_parameters() const { return blocks_.back().offset + blocks_.back().size(); }
  /// Name, place and shape of every parameter array. The arrays follow each other without gaps.
  const std::vector<ParameterBlock>& blocks() const { return blocks_; }

  /// Views of the layers with their parameters, for exports. The layer "streams" of a dueling
  /// network appears as "streams.value" and "streams.advantage". The order is features, value
  /// stream, advantage stream.
  std::vector<LayerView> Views(std::span<const Real> parameters) const;

  /// Sets PyTorch's defaults: weights and biases uniform in ±1/√inputs, layer norm gain 1 and bias
  /// 0.
  void Initialize(Rng& rng, std::span<Real> parameters) const;

  /// Adds `shift` to every output for all inputs. It changes the last bias, or V's bias in a
  /// dueling network.
  void ShiftOutputs(Real shift, std::span<Real> parameters) const;

  /// Results of forward and backward passes, per layer and row of a batch.
  using Activations = std::vector<LayerActivations>;
  /// Makes buffers for up to `max_batch` rows. They include gradients only if `gradients`.
  Activations MakeActivations(int max_batch, bool gradients) const;
  /// The features (B × H) in `a`: the outputs of the last hidden layer.
  AlignedVector<Real>& Features(Activations& a) const { return a[num_hidden() - 1].output; }

  /// Writes y for the given rows of x.
  void Forward(std::span<const Real> parameters, Matrix<const Real> x, RowRange rows,
               Activations& a, Matrix<Real> y) const;

  /// Writes values with the same argmax as y at less cost. For a dueling network, these are the
  /// advantages; the value stream is not computed.
  void ForwardPreferences(std::span<const Real> parameters, Matrix<const Real> x, RowRange rows,
                          Activations& a, Matrix<Real> preferences) const;

  /// Number of tasks of TransposeWeights and BackwardWeights. Tasks are 0 … num_tasks() - 1.
  int num_tasks() const { return static_cast<int>(tasks_.size()); }

  /// Writes a task's share of the transposed weights for the backward pass. `transposed` has
  /// num_parameters numbers, and each weight has its offset.
  void TransposeWeights(int task, std::span<const Real> parameters,
                        std::span<Real> transposed) const;

  /// Computes the gradients of sum(dy · y) with respect to all activations in the given rows of the
  /// last Forward. If there is a `dx` (B × D), it also writes the gradient with respect to the
  /// inputs.
  void BackwardInputs(std::span<const Real> parameters, std::span<const Real> transposed,
                      Matrix<const Real> dy, RowRange rows, Activations& a,
                      Matrix<Real> dx = {}) const;

  /// Writes a task's share of `gradient` (num_parameters) with respect to the parameters, summed
  /// over all rows of x. Returns the sum of squares of that share.
  Real BackwardWeights(int task, Matrix<const Real> x, const Activations& a,
                       std::span<Real> gradient) const;

  /// Computes the gradient of sum(dy · y) after Forward on all rows of x. Writes all of `gradient`,
  /// and `dx` if there is one.
  void Backward(std::span<const Real> parameters, Matrix<const Real> x, Activations& a,
                Matrix<const Real> dy, std::span<Real> gradient, Matrix<Real> dx = {}) const;

 private:
  /// Some rows of one layer's weight. The first task of a layer also has the layer's vectors.
  struct Task {
    size_t layer;
    RowRange rows;
  };

  /// Appends a layer to the parameters.
  void Add(const std::string& name, int in, int out, Activation activation = Activation::kNone,
           bool layer_norm = false);
  size_t num_hidden() const { return shape_.hidden.size(); }
  /// Computes and returns the features of the given rows of x.
  Matrix<const Real> Trunk(std::span<const Real> parameters, Matrix<const Real> x, RowRange rows,
                           Activations& a) const;

  NetworkShape shape_;
  std::vector<Layer> layers_;
  std::vector<ParameterBlock> blocks_;
  std::vector<Task> tasks_;
};

}  // namespace upswing
