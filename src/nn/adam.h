#pragma once

#include <cstdint>
#include <span>

#include "base/aligned.h"
#include "base/archive.h"
#include "base/thread_pool.h"

namespace upswing {

/// Adam (Kingma and Ba, 2015, Algorithm 1) with β1 = 0.9, β2 = 0.999, after clipping by global norm
/// (Pascanu et al., 2013, Algorithm 1). The same pass over memory moves the target parameters, if
/// there are any, by Polyak averaging.
class Adam {
 public:
  static constexpr double kEpsilon = 1e-8;  // the paper's ε

  explicit Adam(size_t num_parameters, double epsilon = kEpsilon);

  /// The size of one step.
  struct Size {
    double learning_rate;
    double gradient_norm;  // global norm of the gradient
    double max_norm;       // a gradient of a larger norm is scaled down to this norm
    double tau;            // target ← target + tau · (parameters - target), after the step
  };

  /// Moves `parameters` against `gradient`, then `target` towards `parameters` (num_parameters
  /// each). An empty `target` means that there is none. Throws Failure and changes nothing if the
  /// norm is not finite.
  void Step(const Size& size, std::span<const float> gradient, std::span<float> parameters,
            std::span<float> target, ThreadPool& pool);

  /// Number of steps so far.
  int64_t steps() const { return steps_; }

  /// Saves or loads the moments and the step count.
  void State(const Archive& archive);

 private:
  double epsilon_;
  int64_t steps_ = 0;
  AlignedVector<float> m_, v_;  // first and second moment (num_parameters)
};

}  // namespace upswing
