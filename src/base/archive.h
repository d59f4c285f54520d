#pragma once

#include <algorithm>
#include <concepts>
#include <cstdint>
#include <limits>
#include <span>
#include <string>
#include <string_view>
#include <type_traits>
#include <utility>
#include <vector>

#include "base/error.h"
#include "base/finite.h"
#include "base/tensors.h"
#include "base/text.h"

namespace upswing {

/// The allowed range of a number in a file: from `lowest` to `highest`, both included.
template <typename T>
struct Bounds {
  T lowest, highest;
};

/// Any finite number.
template <typename T>
inline constexpr Bounds<T> kAnyNumber{std::numeric_limits<T>::lowest(),
                                      std::numeric_limits<T>::max()};

/// Saves or loads state under names. A component has one `void State(const Archive&)` for both
/// directions, so that saving and loading cannot drift apart.
///
/// Files are not trusted: every number has bounds that no training exceeds. Loading throws BadInput
/// if a number is not finite or out of bounds. Saving throws Failure in that case, because such a
/// state is not worth keeping. Only floating-point arrays need no bounds; they must be finite in
/// any case.
class Archive {
 public:
  /// An archive that adds to `file`. It views arrays and does not copy them: write the file before
  /// they change.
  static Archive Saver(Tensors& file) { return {&file, nullptr, ""}; }
  /// An archive that reads from `file`.
  static Archive Loader(const Tensors& file) { return {nullptr, &file, ""}; }

  bool loading() const { return source_ != nullptr; }

  /// This archive with `name/` added to the prefix of all names.
  Archive In(std::string_view name) const { return {target_, source_, Concat(prefix_, name, "/")}; }

  /// Saves or loads an array of known size.
  template <typename T>
  void Array(std::string_view name, std::span<T> values,
             std::type_identity_t<Bounds<T>> bounds) const {
    const std::string path = Concat(prefix_, name);
    if (loading()) source_->Read(path, values);
    CheckNumbers<T>(path, values, bounds);
    if (!loading()) target_->Add<T>(path, values);
  }
  template <std::floating_point T>
  void Array(std::string_view name, std::span<T> values) const {
    Array(name, values, kAnyNumber<T>);
  }

  /// Saves or loads an array of at most `max_size` numbers. Loading resizes it.
  template <typename T>
  void Vector(std::string_view name, std::vector<T>& values, size_t max_size) const {
    if (loading()) {
      const size_t count = source_->Count<T>(Concat(prefix_, name));
      if (count > max_size) {
        throw BadInput(Concat(source_->where(), ": tensor \"", prefix_, name,
                              "\": expected at most ", max_size, " numbers, got ", count));
      }
      values.resize(count);
    }
    Array(name, std::span(values));
  }

  /// When loading, throws BadInput about the tensor `name` unless `valid`.
  void Check(bool valid, std::string_view name, std::string_view expected) const {
    if (loading() && !valid) {
      throw BadInput(
          Concat(source_->where(), ": tensor \"", prefix_, name, "\": expected ", expected));
    }
  }

  /// Saves or loads one number.
  template <typename T>
  requires std::same_as<T, int64_t> || std::same_as<T, double>
  void Scalar(std::string_view name, T& value, std::type_identity_t<Bounds<T>> bounds) const {
    const std::string path = Concat(prefix_, name);
    if (loading()) source_->Read(path, std::span(&value, 1));
    CheckNumbers<T>(path, std::span(&value, 1), bounds);
    if (!loading()) target_->AddScalar(path, value);
  }
  /// Saves or loads a truth value, stored as 1 or 0.
  void Scalar(std::string_view name, bool& value) const {
    int64_t number = value ? 1 : 0;
    Scalar(name, number, {0, 1});
    value = number == 1;
  }

 private:
  template <typename T>
  void CheckNumbers(const std::string& path, std::span<const T> values, Bounds<T> bounds) const {
    std::string problem;
    if constexpr (std::floating_point<T>) problem = FindNotFinite<T>(values);
    const auto outside =
        std::ranges::find_if(values, [&](T x) { return x < bounds.lowest || x > bounds.highest; });
    if (problem.empty() && outside != values.end()) {
      problem = Concat("expected ", bounds.lowest, " to ", bounds.highest, ", got ", *outside,
                       values.size() > 1 ? Concat(" at index ", outside - values.begin()) : "");
    }
    if (problem.empty()) return;
    const std::string what = Concat("tensor \"", path, "\": ", problem);
    throw loading() ? BadInput(Concat(source_->where(), ": ", what)) : Failure(what);
  }

  Archive(Tensors* target, const Tensors* source, std::string prefix)
      : target_(target), source_(source), prefix_(std::move(prefix)) {}

  Tensors* target_;
  const Tensors* source_;
  std::string prefix_;
};

}  // namespace upswing
