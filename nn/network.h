#pragma once

#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "nn/layer.h"

namespace upswing {

/// The shape of a network: D → hidden… → A, or dueling, D → hidden… → { streams → 1, streams → A }.
struct NetworkShape {
  static constexpr int64_t kMaxWidth = 4096;  // units of a layer, inputs, outputs
  static constexpr size_t kMaxLayers = 16;    // hidden ones

  int inputs = 0;               // D
  std::vector<int64_t> hidden;  // widths of the hidden layers
  int outputs = 0;              // A
  bool layer_norm = false;      // layer normalisation between each hidden layer and its activation
  Activation activation = Activation::kRelu;
  int64_t streams = 0;  // of a dueling network: width of each stream's hidden layer; else 0

  bool dueling() const { return streams != 0; }
  /// Such as "8-64-64-9", or dueling "8-64-(32→1, 32→9)".
  std::string Text() const;
  bool operator==(const NetworkShape&) const = default;
};

/// A network from inputs x (B × D) to outputs y (B × A), with one flat array of parameters: hidden
/// layers ("feature.0", …) and a linear one ("output"). A dueling network has instead y = V + A -
/// mean(A) (Wang et al., 2016, Eq 9): the layer "streams" holds the two streams' hidden layers of G
/// units each as one matrix (H × 2G), value first; "value" (G → 1) and "advantage" (G → A) follow.
///
/// Immutable: parameters, gradients and activations belong to the caller, so that one network
/// serves several sets of parameters and any number of threads.
///
/// A gradient takes three steps, each of which threads can share: TransposeWeights over all tasks;
/// Forward and BackwardInputs over slices of the batch; BackwardWeights over all tasks. The result
/// has the same bits for any number of threads. Backward does all of it. For the gradient with
/// respect to the inputs alone, BackwardWeights is left out.
class Network {
 public:
  /// Throws BadInput on invalid sizes.
  explicit Network(NetworkShape shape);

  const NetworkShape& shape() const { return shape_; }
  size_t num_parameters() const { return blocks_.back().offset + blocks_.back().size(); }
  /// Name, place and shape of every parameter array; they follow one another without gaps.
  const std::vector<ParameterBlock>& blocks() const { return blocks_; }
  /// Multiplications of a forward pass for one row.
  double multiply_adds() const;

  /// The layers with their numbers, for exports. A dueling network's layer "streams" is cut into
  /// "streams.value" and "streams.advantage"; the order is features, value stream, advantages.
  std::vector<LayerView> Views(std::span<const Real> parameters) const;

  /// PyTorch's defaults: weights and biases uniform in ±1/√inputs, layer norm gain 1 and bias 0.
  void Initialize(Rng& rng, std::span<Real> parameters) const;

  /// Adds `shift` to every output, for all inputs: to the last bias, of a dueling network V's.
  void ShiftOutputs(Real shift, std::span<Real> parameters) const;

  /// What forward and backward passes leave in each row of a batch, by layer.
  using Activations = std::vector<LayerActivations>;
  /// Buffers for up to `max_batch` rows; those of gradients only if asked for.
  Activations MakeActivations(int max_batch, bool gradients) const;
  /// The features (B × H) that they hold: the outputs of the last hidden layer.
  AlignedVector<Real>& Features(Activations& a) const { return a[num_hidden() - 1].output; }

  /// Writes y, in the given rows.
  void Forward(std::span<const Real> parameters, Matrix<const Real> x, RowRange rows,
               Activations& a, Matrix<Real> y) const;

  /// Values with the same argmax as y, at less cost: of a dueling network the advantages alone,
  /// without the value stream.
  void ForwardPreferences(std::span<const Real> parameters, Matrix<const Real> x, RowRange rows,
                          Activations& a, Matrix<Real> preferences) const;

  /// The tasks of TransposeWeights and BackwardWeights: 0 … num_tasks() - 1.
  int num_tasks() const { return static_cast<int>(tasks_.size()); }

  /// Writes the task's share of the transposed weights, which the backward pass reads:
  /// num_parameters numbers, each weight at its offset.
  void TransposeWeights(int task, std::span<const Real> parameters,
                        std::span<Real> transposed) const;

  /// Gradients of sum(dy · y) with respect to all activations in the given rows of the last
  /// Forward; with a `dx` (B × D), also with respect to the inputs.
  void BackwardInputs(std::span<const Real> parameters, std::span<const Real> transposed,
                      Matrix<const Real> dy, RowRange rows, Activations& a,
                      Matrix<Real> dx = {}) const;

  /// Writes the task's share of `gradient` (num_parameters) with respect to the parameters, summed
  /// over all rows of x. Returns the sum of its squares.
  Real BackwardWeights(int task, Matrix<const Real> x, const Activations& a,
                       std::span<Real> gradient) const;

  /// Gradient of sum(dy · y) after Forward on all rows of x: writes all of `gradient`, and `dx` if
  /// there is one.
  void Backward(std::span<const Real> parameters, Matrix<const Real> x, Activations& a,
                Matrix<const Real> dy, std::span<Real> gradient, Matrix<Real> dx = {}) const;

 private:
  /// Some rows of one layer's weight. The first of a layer's tasks has its vectors too.
  struct Task {
    size_t layer;
    RowRange rows;
  };

  /// Appends a layer to the parameters.
  void Add(const std::string& name, int in, int out, Activation activation = Activation::kNone,
           bool layer_norm = false);
  size_t num_hidden() const { return shape_.hidden.size(); }
  /// Returns the features of the given rows of x.
  Matrix<const Real> Trunk(std::span<const Real> parameters, Matrix<const Real> x, RowRange rows,
                           Activations& a) const;

  NetworkShape shape_;
  std::vector<Layer> layers_;
  std::vector<ParameterBlock> blocks_;
  std::vector<Task> tasks_;
};

}  // namespace upswing
