#pragma once

#include <span>
#include <vector>

#include "nn/heads.h"
#include "nn/mlp.h"
#include "nn/parameter_layout.h"

namespace upswing {

/// A network from inputs x (B × D) to outputs y (B × A): a trunk (nn/mlp.h) and a head on its
/// features (nn/heads.h), with one flat array of parameters. Immutable: parameters, gradients and
/// activations belong to the caller, so that one network serves several sets of parameters and any
/// number of threads. T = float to work, double to check gradients.
///
/// A gradient takes three steps, each of which threads can share: Prepare over all tasks; Forward
/// and BackwardInputs over slices of the batch; BackwardWeights over all tasks. The result has the
/// same bits for any number of threads. Backward does all of
/// it. For the gradient with respect to the inputs alone, BackwardWeights is left out.
template <typename T>
class Network {
 public:
  using Weights = upswing::Weights<T>;
  using Prepared = upswing::Prepared<T>;

  /// Throws BadInput on invalid sizes.
  Network(const MlpShape& trunk, const HeadShape& head);

  size_t num_parameters() const { return layout_.size; }
  /// Name, place and shape of every parameter array; they follow one another without gaps.
  const std::vector<ParameterBlock>& blocks() const { return layout_.blocks; }

  /// PyTorch's defaults: weights and biases uniform in ±1/√inputs, layer norm gain 1 and bias 0.
  void Initialize(Rng& rng, std::span<T> parameters) const;

  /// What forward and backward passes leave in each row of a batch.
  struct Activations {
    std::vector<LayerActivations<T>> trunk, head;  // by layer
  };
  /// Buffers for up to `max_batch` rows; those of gradients only if asked for.
  Activations MakeActivations(int max_batch, bool gradients) const;

  /// Buffers for prepared copies, which the backward pass reads.
  Prepared MakePrepared() const;

  /// Writes y, in the given rows.
  void Forward(Weights weights, Matrix<const T> x, RowRange rows, Activations& a,
               Matrix<T> y) const;

  /// Values with the same argmax as y, at less cost: of a dueling head the advantages alone,
  /// without the value stream.
  void ForwardPreferences(std::span<const T> parameters, Matrix<const T> x, RowRange rows,
                          Activations& a, Matrix<T> preferences) const;

  /// The tasks of Prepare and BackwardWeights: 0 … num_tasks() - 1.
  int num_tasks() const { return static_cast<int>(layout_.tasks.size()); }

  /// Writes the task's share of `prepared`.
  void Prepare(int task, std::span<const T> parameters, Prepared& prepared) const;

  /// Gradients of sum(dy · y) with respect to all activations in the given rows of the last
  /// Forward; with a `dx` (B × D), also with respect to the inputs.
  void BackwardInputs(Weights weights, Matrix<const T> dy, RowRange rows, Activations& a,
                      Matrix<T> dx = {}) const;

  /// Writes the task's share of `gradient` (num_parameters) with respect to the parameters, summed
  /// over all rows of x. Returns the sum of its squares.
  T BackwardWeights(int task, Matrix<const T> x, const Activations& a, std::span<T> gradient) const;

  /// Gradient of sum(dy · y) after Forward on all rows of x: writes all of `gradient`, and `dx` if
  /// there is one.
  void Backward(std::span<const T> parameters, Matrix<const T> x, Activations& a,
                Matrix<const T> dy, std::span<T> gradient, Matrix<T> dx = {}) const;

 private:
  ParameterLayout<T> layout_;
  Mlp<T> trunk_;
  Head<T> head_;
};

extern template class Network<float>;
extern template class Network<double>;

}  // namespace upswing
