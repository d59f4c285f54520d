#include <algorithm>
#include <cmath>
#include <functional>
#include <limits>
#include <numbers>
#include <optional>

#include "base/error.h"
#include "base/rng.h"
#include "base/text.h"
#include "control/pendulum_model.h"
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

/// The next sample of a policy, after the samples so far.
class SampleSource {
 public:
  explicit SampleSource(const ExportedPolicy& policy)
      : policy_(policy), observed_(static_cast<size_t>(policy.obs_size())) {
    const LoadedPolicy& loaded = *policy.loaded;
    if (policy.is_foreign()) return;
    if (loaded.identifies()) {
      identified_from_ = loaded.plant;
      // Other constants than the nominal ones, which the filter has to find.
      DesignPlant moved = loaded.design_plant();
      for (double Plant::*parameter : {&Plant::mass1, &Plant::length2, &Plant::damping1}) {
        moved.*parameter *= 1.1;
      }
      for (double Plant::*parameter : {&Plant::mass2, &Plant::length1, &Plant::damping2}) {
        moved.*parameter *= 0.9;
      }
      motion_.emplace(moved);
    }
    builder_.emplace(1, loaded.scale(), loaded.control_period(), loaded.memory(), identified_from_);
  }

  /// Draws a state (S) of floats: near the motion of a plant from the state before if the policy
  /// identifies the plant, else a random one.
  std::vector<double> DrawState(Rng& rng) const {
    constexpr double kPi = std::numbers::pi, kVelocity = 4;  // rad/s
    std::vector<double> state(policy_.state_size());
    for (size_t k = 0; k < state.size(); ++k) {
      // Angles come first, then equally many velocities; values are rounded to float.
      const double bound = k < state.size() / 2 ? kPi : kVelocity;
      state[k] = rng.Uniform(-bound, bound) * 0.999;
      if (next_) state[k] = (*next_)[static_cast<Eigen::Index>(k)] + kMeasured * state[k];
      state[k] = static_cast<float>(state[k]);
    }
    return state;
  }

  /// The observation of a state (S) as that of sample `i`. Without Keep, the next call replaces it.
  const std::vector<float>& Observe(int i, std::span<const double> s) {
    if (!builder_) {
      observed_.assign(s.begin(), s.end());
      return observed_;
    }
    const LoadedPolicy& loaded = *policy_.loaded;
    const PendulumState state{s[0], s[1], s[2], s[3]};
    after_ = *builder_;
    std::ranges::fill(observed_, 0.0F);
    if (i == 0) {
      after_->Begin(0, loaded.plant, state, observed_);
    } else {
      after_->Next(0, loaded.plant, {state, torque_}, before_, torque_, observed_);
    }
    // The C code goes through the poses in this order, too.
    if (loaded.seeks_any_pose()) {
      WriteGoal(kPoses[static_cast<size_t>(i) % kPoses.size()], loaded.memory(), observed_);
    }
    return observed_;
  }

  /// Keeps the last observation, of the state `s`, at which the policy chose `torque`.
  void Keep(std::span<const double> s, double torque) {
    before_ = observed_;
    builder_ = after_;
    torque_ = torque;
    if (!motion_) return;
    next_ = StateVector(s[0], s[1], s[2], s[3]);
    motion_->Step({&*next_, 1}, {&torque_, 1});
  }

 private:
  static constexpr double kMeasured = 1e-3;  // error of a state of the motion, rad and rad/s, over
                                             // that of a random state

  const ExportedPolicy& policy_;
  std::optional<Plant> identified_from_;
  std::optional<PendulumModel> motion_;
  std::optional<StateVector> next_;                    // of the motion
  std::optional<ObservationBuilder> builder_, after_;  // before and after the last observation
  std::vector<float> observed_, before_;               // (D)
  double torque_ = 0;                                  // N·m, of the sample before
};

/// Whether rounding cannot change which output is the largest.
bool IsClear(std::vector<double> outputs) {
  std::ranges::sort(outputs, std::greater());
  return outputs.size() == 1 || outputs[0] - outputs[1] > 10 * kTolerance * LargestSize(outputs);
}

}  // namespace

CSamples DrawSamples(const ExportedPolicy& policy, const std::vector<LayerView>& layers) {
  CSamples samples;
  Rng rng(0, "samples of a C header");
  SampleSource source(policy);
  const auto memory = policy.loaded->policy->Start(1);
  double largest = 0, torque = 0;
  bool all_clear = true;
  int unclear = 0;  // draws, of all samples together
  for (int i = 0; i < kSamples; ++i) {
    std::vector<double> state, outputs;
    std::vector<float> obs;
    bool is_clear = false;
    while (true) {
      state = source.DrawState(rng);
      obs = source.Observe(i, state);
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
    source.Keep(state, static_cast<float>(torque));
    samples.states.insert(samples.states.end(), state.begin(), state.end());
    if (policy.loaded->identifies()) {
      const auto identified = std::span(obs).subspan(kObservationSize, kIdentifiedSize);
      samples.identified.insert(samples.identified.end(), identified.begin(), identified.end());
    }
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
