#include <algorithm>
#include <cmath>
#include <functional>
#include <limits>
#include <numbers>

#include "base/error.h"
#include "base/rng.h"
#include "base/text.h"
#include "extras/deploy/c_header.h"
#include "pendulum/observation.h"

namespace upswing::deploy {
namespace {

constexpr int kSamples = 16;
constexpr int kMostDraws = 200;      // of all samples
constexpr double kTolerance = 1e-4;  // relative to the largest output
constexpr double kMostFloat = std::numeric_limits<float>::max();

/// The layers' output for an observation, in double precision.
std::vector<double> Evaluate(const std::vector<LayerView>& layers, std::span<const float> obs) {
  std::vector<double> x(obs.begin(), obs.end());
  for (const LayerView& layer : layers) {
    std::vector<double> y(layer.b.begin(), layer.b.end());
    for (int i = 0; i < layer.out(); ++i) {
      for (int j = 0; j < layer.in(); ++j) y[i] += double{layer.W(j, i)} * x[j];
    }
    if (layer.layer_norm()) {
      double mean = 0, square = 0;
      for (const double value : y) mean += value / layer.out();
      for (const double value : y) square += (value - mean) * (value - mean) / layer.out();
      for (size_t i = 0; i < y.size(); ++i) {
        y[i] = (y[i] - mean) / std::sqrt(square + double{kLayerNormEpsilon}) * layer.gain[i] +
               layer.norm_bias[i];
      }
    }
    for (double& value : y) {
      if (layer.activation == Activation::kRelu) value = std::max(value, 0.0);
      if (layer.activation == Activation::kTanh) value = std::tanh(value);
    }
    x = std::move(y);
  }
  return x;
}

/// The observation of a state (S) that consists of floats. `before` is the previous observation, at
/// which the policy chose the torque; empty: none.
std::vector<float> ObservationOf(const ExportedPolicy& policy, std::span<const double> s,
                                 std::span<const float> before, double torque) {
  if (policy.is_foreign()) return {s.begin(), s.end()};
  const auto now = Observe(policy.loaded->plant, {s[0], s[1], s[2], s[3]}, policy.loaded->scale());
  std::vector<float> obs(now.begin(), now.end());
  obs.resize(static_cast<size_t>(policy.obs_size()));
  const int steps = policy.loaded->memory();
  if (steps > 0 && !before.empty())
    Remember(before, torque / policy.loaded->scale().torque, steps, obs);
  return obs;
}

/// Whether rounding cannot change which output is the largest.
bool IsClear(std::vector<double> outputs) {
  std::ranges::sort(outputs, std::greater());
  return outputs.size() == 1 || outputs[0] - outputs[1] > 10 * kTolerance * LargestSize(outputs);
}

}  // namespace

CSamples DrawSamples(const ExportedPolicy& policy, const std::vector<LayerView>& layers) {
  constexpr double kPi = std::numbers::pi, kVelocity = 4;  // rad/s
  CSamples samples;
  Rng rng(0, "samples of a C header");
  const auto memory = policy.loaded->policy->Start(1);
  std::vector<float> before;  // (D)
  double largest = 0, torque = 0;
  bool all_clear = true;
  int unclear = 0;  // draws, of all samples together
  for (int i = 0; i < kSamples; ++i) {
    std::vector<double> state(policy.state_size()), outputs;
    std::vector<float> obs;
    bool is_clear = false;
    while (true) {
      for (size_t k = 0; k < state.size(); ++k) {
        // Angles come first, then equally many velocities; values are rounded to float.
        const double bound = k < state.size() / 2 ? kPi : kVelocity;
        state[k] = static_cast<float>(rng.Uniform(-bound, bound) * 0.999);
      }
      obs = ObservationOf(policy, state, before, torque);
      outputs = Evaluate(layers, obs);
      is_clear = IsClear(outputs);
      if (is_clear) break;
      ++unclear;
      if (unclear >= kMostDraws) break;
    }
    for (const double output : outputs) {
      if (std::abs(output) < kMostFloat) continue;
      throw BadInput(Concat(policy.loaded->path,
                            ": expected outputs within the range of float, got ", output));
    }
    if (!is_clear) all_clear = false;
    policy.loaded->policy->Act({obs.data(), 1, policy.obs_size()}, {&torque, 1, 1}, *memory);
    before = obs;
    samples.states.insert(samples.states.end(), state.begin(), state.end());
    samples.outputs.insert(samples.outputs.end(), outputs.begin(), outputs.end());
    samples.torques.push_back(static_cast<float>(torque));
    largest = std::max(largest, LargestSize(outputs));
  }
  // If all outputs are nearly equal, the policy may choose any of its torques.
  const double of_limit = all_clear ? kTolerance * std::max(1.0, largest) : 2;
  const auto tolerance = [](double size) {
    return static_cast<float>(std::min(size + 1e-30, kMostFloat));
  };
  samples.output_tolerance = tolerance(kTolerance * largest);
  samples.torque_tolerance = tolerance(policy.limit * of_limit);
  return samples;
}

}  // namespace upswing::deploy
