// Environments that Python makes and steps, such as Gymnasium's.
#include <nanobind/stl/string.h>
#include <nanobind/stl/vector.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "base/error.h"
#include "base/rng.h"
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

/// Runs `call`, which needs the interpreter's lock. An exception of Python becomes an error with
/// its message: upswing.InputError, the only ValueError that arrives here, BadInput, others a
/// Failure. KeyboardInterrupt and the like pass through.
template <typename Call>
auto CallPython(const Call& call) -> decltype(call()) {
  try {
    return call();
  } catch (const nb::python_error& error) {
    if (!error.matches(PyExc_Exception)) throw;
    const std::string message = Printable(nb::cast<std::string>(nb::str(error.value())));
    throw error.matches(PyExc_ValueError) ? BadInput(message) : Failure(message);
  }
}

/// N environments that a function in Python steps. The function shares numpy arrays with this
/// object: it reads the actions (N × A) and writes the other arrays. Letters as in base/env.h.
class CallbackEnv final : public VectorEnv {
 public:
  /// `make` is the function make(seeds, for_evaluation, arrays) in Python, which resets the
  /// environments and returns the function that steps them. Needs the interpreter's lock.
  CallbackEnv(const nb::object& make, const EnvConfig& config)
      : spec_(SpecOf(config)),
        action_(NewArray<double>({rows(), static_cast<size_t>(spec_.action_size())})),
        obs_(NewArray<float>({rows(), static_cast<size_t>(spec_.obs_size)})),
        next_obs_(NewArray<float>({rows(), static_cast<size_t>(spec_.obs_size)})),
        reward_(NewArray<double>({rows()})),
        terminated_(NewArray<uint8_t>({rows()})),
        truncated_(NewArray<uint8_t>({rows()})) {
    std::vector<int64_t> seeds;
    for (size_t i = 0; i < rows(); ++i) {
      constexpr uint64_t kSeeds = uint64_t{1} << 31;
      Rng rng(config.seed, config.stream, config.first_index + i);
      seeds.push_back(static_cast<int64_t>(rng.Below(kSeeds)));
    }
    nb::dict arrays;
    arrays["action"] = action_;
    arrays["obs"] = obs_;
    arrays["next_obs"] = next_obs_;
    arrays["reward"] = reward_;
    arrays["terminated"] = terminated_;
    arrays["truncated"] = truncated_;
    step_ = CallPython([&] { return make(seeds, config.for_evaluation, arrays); });
    CheckFinite(ValuesOf(obs_), "observation of a reset");
  }
  CallbackEnv(const CallbackEnv&) = delete;
  CallbackEnv& operator=(const CallbackEnv&) = delete;
  ~CallbackEnv() override {
    const nb::gil_scoped_acquire lock;
    step_.reset();
    for (auto* array : {&obs_, &next_obs_}) *array = {};
    for (auto* array : {&action_, &reward_}) *array = {};
    for (auto* array : {&terminated_, &truncated_}) *array = {};
  }

  const EnvSpec& spec() const override { return spec_; }
  Matrix<const float> obs() const override { return {obs_.data(), spec_.num_envs, spec_.obs_size}; }

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
      CallPython([&] { step_(); });
    }
    CheckFinite(ValuesOf(obs_), "observation");
    CheckFinite(ValuesOf(next_obs_), "observation");
    CheckFinite(ValuesOf(reward_), "reward");
    std::ranges::copy(ValuesOf(next_obs_), result.next_obs.begin());
    std::ranges::copy(ValuesOf(reward_), result.reward.begin());
    std::ranges::copy(ValuesOf(terminated_), result.terminated.begin());
    std::ranges::copy(ValuesOf(truncated_), result.truncated.begin());
  }

  // The environments have no state that the program knows.
  void GetState(int /*env*/, std::span<double> /*state*/) const override {}
  void SetState(int /*env*/, std::span<const double> /*state*/) override {
    throw NoForeignEnvironment(spec_.task);
  }
  /// Saves nothing, so that a run cannot resume.
  void State(const Archive& archive) override {
    if (archive.loading()) throw NoForeignEnvironment(spec_.task);
  }

 private:
  size_t rows() const { return static_cast<size_t>(spec_.num_envs); }

  /// Throws Failure unless these numbers, the same count for each environment, are finite float32
  /// numbers.
  template <typename T>
  void CheckFinite(std::span<T> values, const char* what) const {
    for (size_t i = 0; i < values.size(); ++i) {
      if (std::abs(values[i]) <= std::numeric_limits<float>::max()) continue;
      const size_t size = values.size() / rows();
      throw Failure(Concat("environment ", i / size, ": expected finite float32 numbers, got ",
                           values[i], " in the ", what,
                           size > 1 ? Concat(", component ", i % size) : std::string()));
    }
  }

  EnvSpec spec_;
  Array<double> action_;  // (N × A)
  Array<float> obs_, next_obs_;
  Array<double> reward_;
  Array<uint8_t> terminated_, truncated_;
  nb::object step_;
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
