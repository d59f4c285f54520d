#pragma once

#include <nanobind/nanobind.h>
#include <nanobind/stl/shared_ptr.h>

#include <chrono>
#include <memory>
#include <mutex>
#include <string>
#include <thread>
#include <utility>
#include <vector>

#include "setup/loaded_policy.h"

/// What the parts of the extension module share. The package's Python (python/upswing) wraps these
/// classes and functions; nobody else calls them.
namespace upswing {

/// Settings as Python gives them: name and text of each.
using SettingTexts = std::vector<std::pair<std::string, std::string>>;

/// The same as flags: aliases first, so that what is more specific wins; messages begin with the
/// name.
std::vector<FlagValue> FlagsOf(const SettingTexts& settings);

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
