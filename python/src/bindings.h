#pragma once

#include <nanobind/nanobind.h>
#include <nanobind/ndarray.h>
#include <nanobind/stl/shared_ptr.h>

#include <chrono>
#include <functional>
#include <initializer_list>
#include <map>
#include <memory>
#include <mutex>
#include <numeric>
#include <optional>
#include <string>
#include <thread>
#include <utility>
#include <vector>

#include "agents/loaded_policy.h"
#include "base/error.h"
#include "judge/trial.h"

/// Python's str and the library's texts. Bytes that are not UTF-8, such as in names of files, are
/// surrogates in Python, as os.fsdecode makes them.
template <>
struct nanobind::detail::type_caster<std::string> {
  NB_TYPE_CASTER(std::string, const_name("str"))

  bool from_python(handle source, uint8_t /*flags*/, cleanup_list* /*list*/) noexcept {
    if (!PyUnicode_Check(source.ptr())) return false;
    // A lone surrogate that stands for no byte becomes an escape sequence.
    PyObject* bytes = nullptr;
    for (const char* errors : {"surrogateescape", "backslashreplace"}) {
      if (bytes == nullptr) bytes = PyUnicode_AsEncodedString(source.ptr(), "utf-8", errors);
      if (bytes == nullptr) PyErr_Clear();
    }
    if (bytes == nullptr) return false;
    value.assign(PyBytes_AsString(bytes), static_cast<size_t>(PyBytes_Size(bytes)));
    Py_DECREF(bytes);
    return true;
  }
  static handle from_cpp(const std::string& text, rv_policy, cleanup_list* /*list*/) noexcept {
    return PyUnicode_DecodeUTF8(text.data(), static_cast<Py_ssize_t>(text.size()),
                                "surrogateescape");
  }
};

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

/// A policy with its memories, one for each number of environments. Concurrent calls wait for each
/// other.
class PolicyHandle {
 public:
  explicit PolicyHandle(LoadedPolicy loaded) : loaded_(std::move(loaded)) {}

  const LoadedPolicy& loaded() const { return loaded_; }
  const Policy& policy() const { return *loaded_.policy; }

  /// Calls `work` with a memory for `n` environments.
  template <typename Work>
  void WithMemory(int n, const Work& work) {
    const std::lock_guard lock(mutex_);
    constexpr size_t kMost = 8;
    if (memories_.size() >= kMost) memories_.clear();
    std::unique_ptr<Policy::Memory>& memory = memories_[n];
    if (!memory) memory = policy().Start(n);
    work(*memory);
  }

 private:
  LoadedPolicy loaded_;
  std::mutex mutex_;
  std::map<int, std::unique_ptr<Policy::Memory>> memories_;
};

/// A policy of the double pendulum that calls a Python function: observations (N × D, float32) →
/// torques, N·m (N, or N × 1). Its observations hold `memory` past steps.
LoadedPolicy MakeFunctionPolicy(nanobind::callable function, int memory);

/// A maker of environments that Python makes and steps, by a function in Python (CallbackEnv). The
/// function must outlive the maker and its environments. None: an empty maker.
ForeignMaker MakerOf(const nanobind::object& make);

/// The error of one of the package's own exceptions: upswing.InputError or upswing.Failure.
std::optional<Error> OwnError(const nanobind::python_error& error);

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
void BindMachine(nanobind::module_& m);

}  // namespace upswing
