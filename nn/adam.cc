#include "nn/adam.h"

#include <algorithm>
#include <cmath>

#include "core/error.h"
#include "core/text.h"
#include "nn/linear.h"

namespace upswing {

Adam::Adam(size_t num_parameters) : m_(num_parameters), v_(num_parameters) {}

double Adam::Step(std::span<const float> gradient, double learning_rate, double max_norm,
                  std::span<float> parameters) {
  constexpr double kBeta1 = 0.9;
  constexpr double kBeta2 = 0.999;
  constexpr double kEpsilon = 1e-8;

  const double norm = std::sqrt(SquaredNorm(gradient));
  if (!std::isfinite(norm)) {
    throw Failure(Concat("the gradient's norm is ", norm, ", expected a finite number"));
  }
  const double scale = norm > max_norm ? max_norm / norm : 1.0;

  // m̂ / (sqrt(v̂) + ε) with both bias corrections drawn into step and ε, as the paper proposes.
  ++steps_;
  const double t = static_cast<double>(steps_);
  const double correction1 = 1.0 - std::pow(kBeta1, t);
  const double correction2 = std::sqrt(1.0 - std::pow(kBeta2, t));
  AdamStep<float>(gradient, static_cast<float>(scale), kBeta1, kBeta2,
                  static_cast<float>(learning_rate * correction2 / correction1),
                  static_cast<float>(kEpsilon * correction2), m_, v_, parameters);
  return norm;
}

void Adam::State(const Archive& archive) {
  archive.Scalar("steps", steps_);
  archive.Array("m", std::span(m_));
  archive.Array("v", std::span(v_));
}

}  // namespace upswing
