#include "rl/value_bins.h"

#include <algorithm>
#include <cmath>

#include "nn/gaussian.h"
#include "rl/softmax.h"

namespace upswing {
namespace {

constexpr double kStdInBins = 0.75;

}  // namespace

ValueBins::ValueBins(int count, double low, double high)
    : count_(count), low_(low), width_((high - low) / std::max(1, count)) {}

float ValueBins::Value(std::span<const float> outputs) const {
  if (count_ == 0) return outputs[0];
  const float largest = *std::ranges::max_element(outputs);
  double sum = 0, mean = 0;
  for (size_t k = 0; k < outputs.size(); ++k) {
    const double weight = std::exp(outputs[k] - largest);
    sum += weight;
    mean += weight * Centre(k);
  }
  return static_cast<float>(mean / sum);
}

float ValueBins::Loss(std::span<const float> outputs, float target,
                      std::span<float> gradient) const {
  if (count_ == 0) {
    const float error = outputs[0] - target;
    gradient[0] = error;
    return error * error / 2;
  }
  // Measure in bins from the lower end. The histogram is empty beyond a few standard deviations.
  constexpr double kReach = 6 * kStdInBins;
  const double bins = count_;
  const double at = std::clamp((target - low_) / width_, 0.5, bins - 0.5);
  const auto first = static_cast<size_t>(std::max(0.0, std::floor(at - kReach)));
  const auto last = static_cast<size_t>(std::min(bins, std::ceil(at + kReach)));
  const auto cdf = [&](size_t edge) {
    return NormalCdf((static_cast<double>(edge) - at) / kStdInBins);
  };
  const double total = cdf(last) - cdf(first);
  Softmax<float>(outputs, gradient);
  double loss = 0;
  for (size_t k = first; k < last; ++k) {
    const double share = (cdf(k + 1) - cdf(k)) / total;
    loss -= share * std::log(std::max(1e-30, double{gradient[k]}));
    gradient[k] -= static_cast<float>(share);
  }
  return static_cast<float>(loss);
}

void ValueBins::ValueGradient(std::span<const float> outputs, float scale,
                              std::span<float> gradient) const {
  if (count_ == 0) {
    gradient[0] = scale;
    return;
  }
  const float value = Value(outputs);
  Softmax<float>(outputs, gradient);
  for (size_t k = 0; k < outputs.size(); ++k) {
    gradient[k] *= scale * (static_cast<float>(Centre(k)) - value);
  }
}

}  // namespace upswing
