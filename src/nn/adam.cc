#include "nn/adam.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "base/error.h"
#include "base/text.h"
#include "nn/linear.h"

namespace upswing {
namespace {

constexpr int64_t kMostSteps = 1'000'000'000'000'000;  // more than any training makes

}  // namespace

Adam::Adam(size_t num_parameters, double epsilon)
    : epsilon_(epsilon), m_(num_parameters), v_(num_parameters) {}

void Adam::Step(const Size& size, std::span<const float> gradient, std::span<float> parameters,
                std::span<float> target, ThreadPool& pool) {
  constexpr double kBeta1 = 0.9;
  constexpr double kBeta2 = 0.999;
  constexpr size_t kChunk = 2048;  // numbers per task

  if (!std::isfinite(size.gradient_norm)) {
    throw Failure(
        Concat("the gradient's norm is ", size.gradient_norm, ", expected a finite number"));
  }
  const bool clip = size.gradient_norm > size.max_norm;
  const double scale = clip ? size.max_norm / size.gradient_norm : 1.0;

  // m̂ / (sqrt(v̂) + ε), with both bias corrections in step and ε, as the paper proposes.
  ++steps_;
  const double t = static_cast<double>(steps_);
  const double correction1 = 1.0 - std::pow(kBeta1, t);
  const double correction2 = std::sqrt(1.0 - std::pow(kBeta2, t));
  const AdamConstants constants{static_cast<float>(scale),
                                kBeta1,
                                kBeta2,
                                static_cast<float>(size.learning_rate * correction2 / correction1),
                                static_cast<float>(epsilon_ * correction2),
                                static_cast<float>(size.tau)};

  const size_t chunks = (parameters.size() + kChunk - 1) / kChunk;
  pool.ParallelFor(static_cast<int>(chunks), [&](int chunk) {
    const size_t first = static_cast<size_t>(chunk) * kChunk;
    const size_t count = std::min(kChunk, parameters.size() - first);
    const auto part = [&](auto values) { return values.subspan(first, count); };
    AdamPolyakStep(constants, part(gradient), part(std::span(m_)), part(std::span(v_)),
                   part(parameters), target.empty() ? target : part(target));
  });
}

void Adam::State(const Archive& archive) {
  archive.Scalar("steps", steps_, {0, kMostSteps});
  archive.Array("m", std::span(m_));
  archive.Array("v", std::span(v_), {0, std::numeric_limits<float>::max()});
}

}  // namespace upswing
