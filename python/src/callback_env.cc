// Environments that Python makes and steps, such as Gymnasium's.
#include <nanobind/stl/vector.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>

#include "base/error.h"
#include "base/rng.h"
#include "base/steps.h"
#include "base/text.h"
#include "python/src/bindings.h"

namespace upswing {
namespace {

namespace nb = nanobind;

template <typename T>
using Array = nb::ndarray<nb::numpy, T>;

template <typename T>
std::span<T> ValuesOf(const Array<T>& array) {
  return {array.data(), array.size()};
}

/// Runs `call`, which needs the interpreter's lock. The package's own exceptions become errors, to
/// which a run adds its step and checkpoint. Exceptions of the user's environment pass unchanged.
template <typename Call>
auto CallPython(const Call& call) -> decltype(call()) {
  try {
    return call();
  } catch (const nb::python_error& error) {
    const std::optional<Error> own = OwnError(error);
    if (!own) throw;
    throw *own;
  }
}

/// N environments that a function in Python steps. The function shares numpy arrays with this
/// object: it reads the actions (N × A) and writes the other arrays. Letters as in base/env.h.
class CallbackEnv final : public VectorEnv {
 public:
  /// `make` is the function make(for_evaluation, count, evaluations, arrays) in Python. It returns
  /// an object with the methods begin(seeds) and step(). Needs the interpreter's lock.
  CallbackEnv(const nb::object& make, const EnvConfig& config)
      : spec_(SpecOf(config)),
        seed_(config.seed),
        first_index_(config.first_index),
        stream_(config.stream),
        action_(NewArray<double>({rows(), static_cast<size_t>(spec_.action_size())})),
        obs_(NewArray<double>({rows(), static_cast<size_t>(spec_.obs_size)})),
        next_obs_(NewArray<double>({rows(), static_cast<size_t>(spec_.obs_size)})),
        reward_(NewArray<double>({rows()})),
        terminated_(NewArray<uint8_t>({rows()})),
        truncated_(NewArray<uint8_t>({rows()})),
        float_obs_(obs_.size()) {
    nb::dict arrays;
    arrays["action"] = action_;
    arrays["obs"] = obs_;
    arrays["next_obs"] = next_obs_;
    arrays["reward"] = reward_;
    arrays["terminated"] = terminated_;
    arrays["truncated"] = truncated_;
    lanes_ =
        CallPython([&] { return make(config.for_evaluation, rows(), config.evaluations, arrays); });
    Begin(stream_);
  }
  CallbackEnv(const CallbackEnv&) = delete;
  CallbackEnv& operator=(const CallbackEnv&) = delete;
  ~CallbackEnv() override {
    const nb::gil_scoped_acquire lock;
    lanes_.reset();
    for (auto* array : {&action_, &obs_, &next_obs_, &reward_}) *array = {};
    for (auto* array : {&terminated_, &truncated_}) *array = {};
  }

  const EnvSpec& spec() const override { return spec_; }
  Matrix<const float> obs() const override {
    return {float_obs_.data(), spec_.num_envs, spec_.obs_size};
  }
  Matrix<const float> broken_off() const override {
    return {broken_off_.data(), broken_off_.empty() ? 0 : spec_.num_envs, spec_.obs_size};
  }

  void Step(Matrix<const double> action, StepResult& result) override {
    for (int i = 0; i < action.rows(); ++i) {
      for (int k = 0; k < action.cols(); ++k) {
        const double limit = spec_.action_limit[k];
        const double applied = std::clamp(action(i, k), -limit, limit);
        action_.data()[i * action.cols() + k] = applied;
        result.torque[i * action.cols() + k] = applied;
      }
    }
    {
      const nb::gil_scoped_acquire lock;
      CallPython([&] { lanes_.attr("step")(); });
    }
    ++steps_;
    TakeObs("observation");
    CheckFinite(ValuesOf(next_obs_), "observation");
    CheckFinite(ValuesOf(reward_), "reward");
    std::ranges::transform(ValuesOf(next_obs_), result.next_obs.begin(),
                           [](double x) { return static_cast<float>(x); });
    std::ranges::copy(ValuesOf(reward_), result.reward.begin());
    std::ranges::copy(ValuesOf(terminated_), result.terminated.begin());
    std::ranges::copy(ValuesOf(truncated_), result.truncated.begin());
  }

  /// Saves the observations only. Loading begins new episodes.
  void State(const Archive& archive) override {
    archive.Array("obs", std::span(float_obs_));
    archive.Scalar("steps", steps_, {0, kMostSteps});
    if (!archive.loading()) return;
    broken_off_ = float_obs_;
    const nb::gil_scoped_acquire lock;
    Begin(Concat(stream_, " after ", steps_, " steps"));
  }

 private:
  size_t rows() const { return static_cast<size_t>(spec_.num_envs); }

  /// Begins an episode in each environment, with seeds of this stream. Needs the interpreter's
  /// lock.
  void Begin(const std::string& stream) {
    std::vector<int64_t> seeds;
    for (size_t i = 0; i < rows(); ++i) {
      constexpr uint64_t kSeeds = uint64_t{1} << 31;
      Rng rng(seed_, stream, first_index_ + i);
      seeds.push_back(static_cast<int64_t>(rng.Below(kSeeds)));
    }
    CallPython([&] { lanes_.attr("begin")(seeds); });
    TakeObs("observation of a reset");
  }

  void TakeObs(const char* what) {
    CheckFinite(ValuesOf(obs_), what);
    std::ranges::transform(ValuesOf(obs_), float_obs_.begin(),
                           [](double x) { return static_cast<float>(x); });
  }

  /// Throws BadInput unless these numbers, the same count for each environment, are finite float32
  /// numbers.
  void CheckFinite(std::span<const double> values, const char* what) const {
    for (size_t i = 0; i < values.size(); ++i) {
      if (std::abs(values[i]) <= std::numeric_limits<float>::max()) continue;
      const size_t size = values.size() / rows();
      throw BadInput(Concat("environment ", i / size, ": expected finite float32 numbers, got ",
                            values[i], " in the ", what,
                            size > 1 ? Concat(", component ", i % size) : std::string()));
    }
  }

  EnvSpec spec_;
  uint64_t seed_, first_index_;
  std::string stream_;
  // Shared with Python. Observations are double, so that messages name what Python returned.
  Array<double> action_, obs_, next_obs_, reward_;  // (N × A), (N × D), (N × D), (N)
  Array<uint8_t> terminated_, truncated_;           // (N)
  nb::object lanes_;
  std::vector<float> float_obs_, broken_off_;  // (N × D)
  int64_t steps_ = 0;
};

}  // namespace

ForeignMaker MakerOf(const nb::object& make) {
  if (make.is_none()) return {};
  // Copies of the maker may die without the interpreter's lock; only the caller owns `make`.
  const nb::handle function = make;
  return [function](const EnvConfig& config) -> std::unique_ptr<VectorEnv> {
    const nb::gil_scoped_acquire lock;
    return std::make_unique<CallbackEnv>(nb::borrow(function), config);
  };
}

}  // namespace upswing
