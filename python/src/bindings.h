#pragma once

#include <nanobind/nanobind.h>
#include <nanobind/ndarray.h>
#include <nanobind/stl/shared_ptr.h>

#include <chrono>
#include <functional>
#include <initializer_list>
#include <memory>
#include <mutex>
#include <numeric>
#include <string>
#include <thread>
#include <utility>
#include <vector>

#include "agents/loaded_policy.h"
#include "judge/trial.h"

/// Shared parts of the extension module. Only the package's Python code (python/upswing) uses its
/// classes and functions.
namespace upswing {

/// Settings from Python: name and text of each.
using SettingTexts = std::vector<std::pair<std::string, std::string>>;

/// Converts settings to flags. Aliases come first, so that a more specific setting wins; error
/// messages begin with the name.
std::vector<FlagValue> FlagsOf(const SettingTexts& settings);

/// Whether environments have this setting, not only trainings.
bool IsEnvironmentSetting(const Option& option);

/// Plant, sensors and motor for trying a policy.
struct TrialSurroundings {
  Plant plant;
  TrialConditions conditions;

  void Describe(Options& o) {
    plant.Describe(o);
    conditions.Describe(o);
  }
};

/// A new array of this shape with uninitialised numbers.
template <typename T>
nanobind::ndarray<nanobind::numpy, T> NewArray(std::initializer_list<size_t> shape) {
  auto* numbers = new T[std::accumulate(shape.begin(), shape.end(), size_t{1}, std::multiplies())];
  const nanobind::capsule owner(numbers, [](void* p) noexcept { delete[] static_cast<T*>(p); });
  return {numbers, shape, owner};
}

/// A plant's values by name.
nanobind::dict PlantDict(const Plant& plant);

/// A policy with a pool of memories, one for each concurrent call.
class PolicyHandle {
 public:
  explicit PolicyHandle(LoadedPolicy loaded) : loaded_(std::move(loaded)) {}

  const LoadedPolicy& loaded() const { return loaded_; }
  const Policy& policy() const { return *loaded_.policy; }

  /// Calls `work` with a memory for `n` environments.
  template <typename Work>
  void WithMemory(int n, const Work& work) {
    SizedMemory memory = Take(n);
    work(*memory.memory);
    Keep(std::move(memory));
  }

 private:
  struct SizedMemory {
    int num_envs;
    std::unique_ptr<Policy::Memory> memory;
  };
  SizedMemory Take(int n);
  /// Stores a memory for later calls, unless there are many already.
  void Keep(SizedMemory memory);

  LoadedPolicy loaded_;
  std::mutex mutex_;
  std::vector<SizedMemory> free_;  // in order of last use, oldest first
};

/// A policy of the double pendulum that calls a Python function: observations (N × D, float32) →
/// torques, N·m (N, or N × 1). Its observations hold `memory` past steps.
LoadedPolicy MakeFunctionPolicy(nanobind::callable function, int memory);

/// A maker of environments that Python makes and steps, by a function in Python (CallbackEnv). The
/// function must outlive the maker and its environments. None: an empty maker.
ForeignMaker MakerOf(const nanobind::object& make);

/// Throws the Python exception of a pending signal, such as Ctrl-C. Needs the interpreter's lock.
void CheckSignals();

/// Decides when long work gives Python a turn: at intervals, and only in the thread that created
/// this object.
class Interrupts {
 public:
  /// Whether this is that thread and its last turn is long enough ago.
  bool due();

 private:
  std::thread::id thread_ = std::this_thread::get_id();
  std::chrono::steady_clock::time_point last_ = std::chrono::steady_clock::now();
};

// Functions that bind one part each, with its classes and functions.
void BindErrors(nanobind::module_& m);
void BindSettings(nanobind::module_& m);
void BindEnvironments(nanobind::module_& m);
void BindPolicies(nanobind::module_& m);
void BindTraining(nanobind::module_& m);
void BindEvaluation(nanobind::module_& m);

}  // namespace upswing
