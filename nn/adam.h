#pragma once

#include <cstdint>
#include <span>

#include "core/aligned.h"
#include "core/archive.h"

namespace upswing {

/// Adam (Kingma and Ba, 2015, Algorithm 1) with β1 = 0.9, β2 = 0.999, ε = 1e-8, behind clipping by
/// global norm (Pascanu et al., 2013, Algorithm 1).
class Adam {
 public:
  explicit Adam(size_t num_parameters);

  /// Moves `parameters` against `gradient` (both num_parameters). If the gradient's norm is above
  /// `max_norm` it is scaled down to that. Returns the norm before; throws Failure, with nothing
  /// changed, if it is not finite.
  double Step(std::span<const float> gradient, double learning_rate, double max_norm,
              std::span<float> parameters);

  /// Saves or loads the moments and the step count.
  void State(const Archive& archive);

 private:
  int64_t steps_ = 0;
  AlignedVector<float> m_, v_;  // first and second moment (num_parameters)
};

}  // namespace upswing
