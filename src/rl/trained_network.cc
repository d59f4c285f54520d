#include "rl/trained_network.h"

#include <algorithm>
#include <cmath>
#include <numeric>

namespace upswing {

TrainedNetwork::TrainedNetwork(const NetworkShape& shape, int batch, Rng rng)
    : TrainedNetwork(shape, batch, Adam::kEpsilon) {
  network_.Initialize(rng, theta_);
}

TrainedNetwork::TrainedNetwork(const NetworkShape& shape, int batch, double adam_epsilon)
    : network_(shape),
      theta_(network_.num_parameters()),
      gradient_(theta_.size()),
      transposed_(theta_.size()),
      adam_(theta_.size(), adam_epsilon),
      activations_(network_.MakeActivations(batch, true)),
      squares_(network_.num_tasks()) {}

void TrainedNetwork::Prepare(ThreadPool& pool) {
  if (!moved_) return;
  moved_ = false;
  pool.ParallelFor(network_.num_tasks(),
                   [&](int task) { network_.TransposeWeights(task, theta_, transposed_); });
}

double TrainedNetwork::Step(Matrix<const float> x, double learning_rate, double max_norm,
                            std::span<float> target, double tau, ThreadPool& pool) {
  pool.ParallelFor(network_.num_tasks(), [&](int task) {
    squares_[task] = network_.BackwardWeights(task, x, activations_, gradient_);
  });
  const double norm = std::sqrt(std::accumulate(squares_.begin(), squares_.end(), 0.0));
  moved_ = true;
  adam_.Step({learning_rate, norm, max_norm, tau}, gradient_, theta_, target, pool);
  return norm;
}

bool TrainedNetwork::StartFrom(const NetworkPolicyParts& policy, ActionRule rule,
                               std::initializer_list<std::span<float>> averages) {
  if (policy.rule != rule || policy.shape != network_.shape()) return false;
  std::ranges::copy(policy.parameters, mutable_theta().begin());
  for (const std::span<float> average : averages) std::ranges::copy(theta_, average.begin());
  return true;
}

void TrainedNetwork::State(const Archive& archive) {
  moved_ = true;
  archive.Array("theta", std::span(theta_));
  adam_.State(archive.In("adam"));
  archive.Array("last_features", features());
}

}  // namespace upswing
