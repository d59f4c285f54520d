#pragma once

#include <algorithm>
#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "core/aligned.h"
#include "core/matrix.h"
#include "core/rng.h"

namespace upswing {

/// The shape of a Q-network. D = observation size, A = number of actions, H = last feature width.
struct QNetworkShape {
  static constexpr int64_t kMaxWidth = 4096;  // units of a layer, inputs, actions
  static constexpr size_t kMaxLayers = 16;    // feature layers

  int inputs = 0;               // D
  int actions = 0;              // A
  std::vector<int64_t> hidden;  // widths of the feature layers, each with ReLU
  int64_t head = 0;             // width of each dueling stream's hidden layer
  bool dueling = false;     // Q = V + A - mean(A) (Wang et al., 2016, Eq 9) instead of one layer
  bool layer_norm = false;  // layer normalisation between each feature layer and its ReLU

  bool operator==(const QNetworkShape&) const = default;
};

/// A named parameter array within the network's flat parameters.
struct ParameterBlock {
  std::string name;  // such as "feature.0.weight"
  size_t offset;     // first number
  int in, out;       // a weight is (in × out); in is 0 for a vector of `out` numbers
  size_t size() const { return static_cast<size_t>(std::max(1, in)) * static_cast<size_t>(out); }
};

/// Some consecutive rows of a batch.
struct RowRange {
  int first, count;
};

/// A plain or dueling multi-layer perceptron from observations to Q-values. Immutable: parameters,
/// gradients and activations belong to the caller, so that one network serves the online and the
/// target parameters and any number of threads. T = float to work, double to check gradients.
///
///   plain:    D → hidden… → A
///   dueling:  D → hidden… → { head → 1,  head → A },  Q = V + A - mean(A)
///
/// The hidden layers of the two streams are one matrix (H × 2·head): value first, then advantage.
///
/// A gradient takes three steps, each of which threads can share: Prepare over all tasks; Forward
/// and BackwardInputs over slices of the batch; BackwardWeights over all tasks. The result has the
/// same bits for any number of threads; with `bfloat16`, for the same slices. Backward does all of
/// it.
template <typename T>
class QNetwork {
 public:
  /// With `bfloat16`, which T = float alone can have, products of prepared weights round their
  /// operands (nn/bfloat16.h); sums, activations and parameters stay float. Throws BadInput on
  /// invalid sizes, and if this processor has no such instructions.
  explicit QNetwork(QNetworkShape shape, bool bfloat16 = false);

  const QNetworkShape& shape() const { return shape_; }
  size_t num_parameters() const { return num_parameters_; }
  /// Name, place and shape of every parameter array; they follow one another without gaps.
  const std::vector<ParameterBlock>& blocks() const { return blocks_; }

  /// PyTorch's defaults: weights and biases uniform in ±1/√inputs, layer norm gain 1 and bias 0.
  void Initialize(Rng& rng, std::span<T> parameters) const;

  /// What forward and backward passes leave in each row of a batch.
  struct Activations {
    std::vector<AlignedVector<T>> normal;   // per feature layer (B × width): x̂, if layer_norm
    std::vector<AlignedVector<T>> inv_std;  // per feature layer (B), if layer_norm
    std::vector<AlignedVector<T>> feature;  // per feature layer (B × width), after ReLU
    AlignedVector<T> streams;               // (B × 2·head) hidden layers of both streams
    AlignedVector<T> value;                 // (B × 1)
    // Gradients of the same places; of a feature layer before ReLU and before layer norm.
    std::vector<AlignedVector<T>> grad_normal, grad_feature;
    AlignedVector<T> grad_streams, grad_value, grad_output;  // grad_output (B × A)
  };
  /// Buffers for up to `max_batch` rows; those of gradients only if asked for.
  Activations MakeActivations(int max_batch, bool gradients) const;

  /// Copies of the weights in the layouts that products read, each at its parameter's offset.
  struct Prepared {
    AlignedVector<T> transposed;                      // (out × in), for the backward pass
    AlignedVector<uint32_t> pairs, transposed_pairs;  // bfloat16 pairs of both; else empty
  };
  /// Buffers for them (num_parameters each); those of the backward pass only if asked for.
  Prepared MakePrepared(bool backward) const;

  /// Parameters and their prepared copies; a forward pass in float works without the copies.
  struct Weights {
    std::span<const T> parameters;
    const Prepared* prepared = nullptr;
  };

  /// Q-values q (B × A) of observations x (B × D), in the given rows.
  void Forward(Weights weights, Matrix<const T> x, RowRange rows, Activations& a,
               Matrix<T> q) const;

  /// Values with the same argmax as Q, at less cost: of a dueling network the advantages alone,
  /// without the value stream.
  void ForwardPreferences(std::span<const T> parameters, Matrix<const T> x, RowRange rows,
                          Activations& a, Matrix<T> preferences) const;

  /// The tasks of Prepare and BackwardWeights: 0 … num_tasks() - 1.
  int num_tasks() const { return static_cast<int>(tasks_.size()); }

  /// Writes the task's share of `prepared`, for the buffers that it has.
  void Prepare(int task, std::span<const T> parameters, Prepared& prepared) const;

  /// Gradients of sum(dq · q) with respect to all activations in the given rows of the last
  /// Forward.
  void BackwardInputs(Weights weights, Matrix<const T> dq, RowRange rows, Activations& a) const;

  /// Writes the task's share of `gradient` (num_parameters) with respect to the parameters, summed
  /// over all rows of x. Returns the sum of its squares.
  T BackwardWeights(int task, Matrix<const T> x, const Activations& a, std::span<T> gradient) const;

  /// Gradient of sum(dq · q) after Forward on all rows of x: writes all of `gradient`.
  void Backward(std::span<const T> parameters, Matrix<const T> x, Activations& a,
                Matrix<const T> dq, std::span<T> gradient) const;

 private:
  struct Layer {
    size_t weight, bias;  // indices into blocks_; of a layer norm, gain and bias
  };
  /// Consecutive rows of one layer's weight. The first of a layer's tasks has its vectors too.
  struct Task {
    size_t layer;  // index into layers_
    RowRange rows;
  };
  size_t AddBlock(std::string name, int in, int out);
  void AddLayer(const std::string& name, int in, int out);
  void AddTasks();

  // The layers: features, then streams and value if dueling, and the output (or advantage) last.
  size_t num_features() const { return shape_.hidden.size(); }
  const Layer& streams() const { return layers_[num_features()]; }
  const Layer& value() const { return layers_[num_features() + 1]; }
  const Layer& output() const { return layers_.back(); }

  Matrix<const T> Weight(std::span<const T> parameters, const Layer& layer) const;
  std::span<const T> Vector(std::span<const T> parameters, size_t block) const;
  void Apply(Weights weights, const Layer& layer, Matrix<const T> x, bool relu, Matrix<T> y) const;
  void ApplyBackward(Weights weights, const Layer& layer, Matrix<const T> dy, Matrix<const T> gate,
                     Matrix<T> dx) const;
  Matrix<const T> ForwardFeatures(Weights weights, Matrix<const T> x, RowRange rows,
                                  Activations& a) const;
  void BackwardStreams(Weights weights, Matrix<const T> dq, RowRange rows, Activations& a) const;
  Matrix<const T> LayerInput(size_t layer, Matrix<const T> x, const Activations& a) const;
  Matrix<const T> LayerGradient(size_t layer, int batch, const Activations& a) const;

  QNetworkShape shape_;
  bool bfloat16_;
  size_t num_parameters_ = 0;
  std::vector<ParameterBlock> blocks_;
  std::vector<Layer> layers_;
  std::vector<Layer> norms_;  // one for each feature layer, if layer_norm
  std::vector<Task> tasks_;
};

extern template class QNetwork<float>;
extern template class QNetwork<double>;

}  // namespace upswing
