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

#include "judge/trial.h"
#include "setup/loaded_policy.h"

/// What the parts of the extension module share. The package's Python (python/upswing) wraps these
/// classes and functions; nobody else calls them.
namespace upswing {

/// Settings as Python gives them: name and text of each.
using SettingTexts = std::vector<std::pair<std::string, std::string>>;

/// The same as flags: aliases first, so that what is more specific wins; messages begin with the
/// name.
std::vector<FlagValue> FlagsOf(const SettingTexts& settings);

/// Whether a setting of a training is one of its environments too.
bool IsEnvironmentSetting(const Option& option);

/// Plant, sensors and motor that a policy is tried on.
struct TrialSurroundings {
  Plant plant;
  TrialConditions conditions;

  void Describe(Options& o) {
    plant.Describe(o);
    conditions.Describe(o);
  }
};

/// A new array of this shape, whose numbers are still to be set.
template <typename T>
nanobind::ndarray<nanobind::numpy, T> NewArray(std::initializer_list<size_t> shape) {
  auto* numbers = new T[std::accumulate(shape.begin(), shape.end(), size_t{1}, std::multiplies())];
  const nanobind::capsule owner(numbers, [](void* p) noexcept { delete[] static_cast<T*>(p); });
  return {numbers, shape, owner};
}

/// A plant's values by name.
nanobind::dict PlantDict(const Plant& plant);

/// A policy and memories to act with, one for each call that runs at a time.
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
  /// For later calls, unless there are many.
  void Keep(SizedMemory memory);

  LoadedPolicy loaded_;
  std::mutex mutex_;
  std::vector<SizedMemory> free_;  // the longest unused first
};

/// A policy of the double pendulum that asks a Python function: observations (N × D, float32) →
/// torques, N·m (N, or N × 1). Its observations remember `memory` steps.
LoadedPolicy MakeFunctionPolicy(nanobind::callable function, int memory);

/// Throws the Python exception of a signal that has come, such as that of Ctrl-C. Needs the
/// interpreter's lock.
void CheckSignals();

/// When long work is to let Python in: now and then, in the thread that made this alone.
class Interrupts {
 public:
  /// Whether this is that thread, and its last turn is a while ago.
  bool due();

 private:
  std::thread::id thread_ = std::this_thread::get_id();
  std::chrono::steady_clock::time_point last_ = std::chrono::steady_clock::now();
};

// The parts, each with its classes and functions.
void BindErrors(nanobind::module_& m);
void BindSettings(nanobind::module_& m);
void BindEnvironments(nanobind::module_& m);
void BindPolicies(nanobind::module_& m);
void BindTraining(nanobind::module_& m);
void BindEvaluation(nanobind::module_& m);

}  // namespace upswing
