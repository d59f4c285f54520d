#pragma once

#include <cstdint>
#include <span>

#include "core/aligned.h"
#include "core/archive.h"
#include "core/thread_pool.h"

namespace upswing {

/// Adam (Kingma and Ba, 2015, Algorithm 1) with β1 = 0.9, β2 = 0.999, after clipping by
/// global norm (Pascanu et al., 2013, Algorithm 1). The same pass over memory moves the target
/// parameters by Polyak averaging, where there are any.
class Adam {
 public:
  static constexpr double kEpsilon = 1e-8;  // the paper's ε

  explicit Adam(size_t num_parameters, double epsilon = kEpsilon);

  /// The size of one step.
  struct Size {
    double learning_rate;
    double gradient_norm;  // the global norm of the gradient…
    double max_norm;       // …and what it is scaled down to if it is above
    double tau;            // target ← target + tau · (parameters - target), after the step
  };

  /// Moves `parameters` against `gradient`, then `target` towards them (num_parameters each; an
  /// empty target: there is none). Throws Failure, with nothing changed, if the norm is not finite.
  void Step(const Size& size, std::span<const float> gradient, std::span<float> parameters,
            std::span<float> target, ThreadPool& pool);

  /// How many there were.
  int64_t steps() const { return steps_; }

  /// Saves or loads the moments and the step count.
  void State(const Archive& archive);

 private:
  double epsilon_;
  int64_t steps_ = 0;
  AlignedVector<float> m_, v_;  // first and second moment (num_parameters)
};

}  // namespace upswing
