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
  int rows, cols;    // (out, in) of a matrix; rows is 0 for a vector of cols numbers
  size_t size() const { return static_cast<size_t>(std::max(1, rows)) * static_cast<size_t>(cols); }
  /// Its shape as a tensor: two extents or one.
  std::vector<int64_t> extents() const {
    return rows == 0 ? std::vector<int64_t>{cols} : std::vector<int64_t>{rows, cols};
  }
};

/// A plain or dueling multi-layer perceptron from observations to Q-values. Immutable: parameters,
/// gradients and activations belong to the caller, so that one network serves the online and the
/// target parameters and any number of threads. T = float to work, double to check gradients.
///
///   plain:    D → hidden… → A
///   dueling:  D → hidden… → { head → 1,  head → A },  Q = V + A - mean(A)
///
/// The hidden layers of the two streams are one matrix (2·head × H): value first, then advantage.
template <typename T>
class QNetwork {
 public:
  explicit QNetwork(QNetworkShape shape);

  const QNetworkShape& shape() const { return shape_; }
  size_t num_parameters() const { return num_parameters_; }
  /// Name, place and shape of every parameter array; they follow one another without gaps.
  const std::vector<ParameterBlock>& blocks() const { return blocks_; }

  /// PyTorch's defaults: weights and biases uniform in ±1/√inputs, layer norm gain 1 and bias 0.
  void Initialize(Rng& rng, std::span<T> parameters) const;

  /// The activations of one forward pass, which the backward pass needs. One for each thread.
  struct Activations {
    int max_batch = 0;
    std::vector<AlignedVector<T>> normal;     // per feature layer (B × width): x̂, if layer_norm
    std::vector<AlignedVector<T>> inv_std;    // per feature layer (B), if layer_norm
    std::vector<AlignedVector<T>> feature;    // per feature layer (B × width), after ReLU
    AlignedVector<T> streams;                 // (B × 2·head) hidden layers of both streams
    AlignedVector<T> value_in, advantage_in;  // (B × head) each
    AlignedVector<T> value;                   // (B × 1)
    // Gradients on their way back.
    AlignedVector<T> grad_a, grad_b;  // (B × widest feature layer), by turns
    AlignedVector<T> grad_streams, grad_head, grad_advantage;  // (B × 2·head), (B × head), (B × A)
  };
  /// Room for up to `max_batch` rows.
  Activations MakeActivations(int max_batch) const;

  /// Q-values q (B × A) of observations x (B × D).
  void Forward(std::span<const T> parameters, Matrix<const T> x, Activations& a, Matrix<T> q) const;

  /// Gradient of sum(dq · q) with respect to the parameters, once after each Forward on the same x,
  /// whose activations it uses up: writes all of `gradient` (num_parameters).
  void Backward(std::span<const T> parameters, Matrix<const T> x, Activations& a,
                Matrix<const T> dq, std::span<T> gradient) const;

 private:
  struct Linear {
    size_t weight, bias;  // indices into blocks_
  };
  size_t AddBlock(std::string name, int rows, int cols);
  Linear AddLinear(const std::string& name, int out, int in);

  Matrix<const T> Weight(std::span<const T> parameters, const Linear& layer) const;
  std::span<const T> Vector(std::span<const T> parameters, size_t block) const;
  void Apply(std::span<const T> parameters, const Linear& layer, Matrix<const T> x,
             Matrix<T> y) const;
  void BackwardStreams(std::span<const T> parameters, Matrix<const T> feature, Activations& a,
                       Matrix<const T> dq, std::span<T> gradient, Matrix<T> dfeature) const;
  void ApplyBackward(std::span<const T> parameters, const Linear& layer, Matrix<const T> x,
                     Matrix<const T> dy, std::span<T> gradient, Matrix<T> dx) const;

  QNetworkShape shape_;
  size_t num_parameters_ = 0;
  std::vector<ParameterBlock> blocks_;
  std::vector<Linear> features_;           // one for each hidden width
  std::vector<Linear> norms_;              // gain and bias, if layer_norm
  Linear streams_{}, value_{}, output_{};  // dueling: all three; plain: output_ alone
};

extern template class QNetwork<float>;
extern template class QNetwork<double>;

}  // namespace upswing
