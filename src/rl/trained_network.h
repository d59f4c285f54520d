#pragma once

#include <initializer_list>
#include <span>
#include <vector>

#include "base/aligned.h"
#include "base/archive.h"
#include "base/matrix.h"
#include "base/thread_pool.h"
#include "nn/adam.h"
#include "nn/network.h"
#include "nn/network_policy.h"
#include "rl/replay/slices.h"

namespace upswing {

/// A network with its parameters θ and everything that training needs: gradient, Adam's moments,
/// and buffers of a minibatch of B rows.
class TrainedNetwork {
 public:
  /// Starts with PyTorch's initial parameters.
  TrainedNetwork(const NetworkShape& shape, int batch, Rng rng);
  /// Starts with parameters of 0, which the caller must set. `adam_epsilon` is Adam's ε.
  TrainedNetwork(const NetworkShape& shape, int batch, double adam_epsilon);

  const Network& network() const { return network_; }
  std::span<const float> theta() const { return theta_; }
  std::span<float> mutable_theta() {
    moved_ = true;
    return theta_;
  }
  /// Sets θ and the averages of it, if `policy` has this network.
  bool StartFrom(const NetworkPolicyParts& policy, ActionRule rule,
                 std::initializer_list<std::span<float>> averages);
  /// The features (B × H) of the last Forward.
  std::span<float> features() { return network_.Features(activations_); }

  /// Transposes the weights if θ has changed. Call it before Backward.
  void Prepare(ThreadPool& pool);
  /// Computes y = network(x) for the given rows, with the given parameters or with θ.
  void Forward(std::span<const float> parameters, Matrix<const float> x, RowRange rows,
               Matrix<float> y) {
    network_.Forward(parameters, x, rows, activations_, y);
  }
  void Forward(Matrix<const float> x, RowRange rows, Matrix<float> y) {
    Forward(theta_, x, rows, y);
  }
  /// Runs the backward pass of the given rows after Forward with θ; see Network::BackwardInputs.
  void Backward(Matrix<const float> dy, RowRange rows, Matrix<float> dx = {}) {
    network_.BackwardInputs(theta_, transposed_, dy, rows, activations_, dx);
  }
  /// Makes one step of Adam along the gradient of Backward for the inputs x (B × D). θ moves, and
  /// `target` follows it with rate tau. Returns the gradient's norm before it is clipped to
  /// max_norm. Throws Failure if the norm is not finite.
  double Step(Matrix<const float> x, double learning_rate, double max_norm, std::span<float> target,
              double tau, ThreadPool& pool);

  /// Saves or loads θ, Adam's moments and, for the metrics, the features of the last minibatch.
  void State(const Archive& archive);
  int64_t steps() const { return adam_.steps(); }

 private:
  Network network_;
  AlignedVector<float> theta_, gradient_, transposed_;  // (num_parameters)
  Adam adam_;
  Network::Activations activations_;
  bool moved_ = true;           // whether θ has changed since transposed_ was computed
  std::vector<float> squares_;  // sum of squares of the gradient, per task
};

}  // namespace upswing
