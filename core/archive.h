#pragma once

#include <concepts>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "core/error.h"
#include "core/finite.h"
#include "core/tensor_file.h"
#include "core/text.h"

namespace upswing {

/// Saves or loads state under names. A component has one `void State(const Archive&)` that serves
/// both ways, so that what is saved and what is loaded cannot drift apart.
class Archive {
 public:
  /// An archive that adds to `file`. Arrays are viewed, not copied: save before they change.
  static Archive Saver(TensorFile& file) { return {&file, nullptr, ""}; }
  /// An archive that reads from `file`.
  static Archive Loader(const TensorFile& file) { return {nullptr, &file, ""}; }

  bool loading() const { return source_ != nullptr; }

  /// The same archive, with names that begin with `name/`.
  Archive In(std::string_view name) const { return {target_, source_, Concat(prefix_, name, "/")}; }

  /// An array whose size is settled before it is loaded. Throws BadInput on loading and Failure on
  /// saving if a number is not finite: no such state is worth keeping.
  template <typename T>
  void Array(std::string_view name, std::span<T> values) const {
    const std::string path = Concat(prefix_, name);
    if (loading()) source_->Read(path, values);
    if constexpr (std::floating_point<T>) CheckFinite(path, values);
    if (!loading()) target_->Add<T>(path, values);
  }

  /// An array that is resized to what is loaded, of at most `max_size` numbers.
  template <typename T>
  void Vector(std::string_view name, std::vector<T>& values, size_t max_size) const {
    if (loading()) {
      const size_t count = source_->Count<T>(Concat(prefix_, name));
      if (count > max_size) {
        throw BadInput(Concat(source_->path(), ": tensor \"", prefix_, name,
                              "\": expected at most ", max_size, " numbers, got ", count));
      }
      values.resize(count);
    }
    Array(name, std::span(values));
  }

  /// On loading, throws BadInput unless what was loaded under `name` is valid.
  void Check(bool valid, std::string_view name, std::string_view expected) const {
    if (loading() && !valid) {
      throw BadInput(
          Concat(source_->path(), ": tensor \"", prefix_, name, "\": expected ", expected));
    }
  }

  /// One number. Integers are stored as I64, bool too.
  template <typename T>
  requires std::integral<T> || std::floating_point<T>
  void Scalar(std::string_view name, T& value) const {
    using Stored = std::conditional_t<std::floating_point<T>, T, int64_t>;
    const std::string path = Concat(prefix_, name);
    if (loading()) {
      Stored stored{};
      source_->Read(path, std::span(&stored, 1));
      value = static_cast<T>(stored);
    } else {
      target_->AddScalar(path, static_cast<Stored>(value));
    }
  }

 private:
  template <typename T>
  void CheckFinite(const std::string& path, std::span<T> values) const {
    const std::string problem = FindNotFinite<T>(values);
    if (problem.empty()) return;
    const std::string what = Concat("tensor \"", path, "\": ", problem);
    throw loading() ? BadInput(Concat(source_->path(), ": ", what)) : Failure(what);
  }

  Archive(TensorFile* target, const TensorFile* source, std::string prefix)
      : target_(target), source_(source), prefix_(std::move(prefix)) {}

  TensorFile* target_;
  const TensorFile* source_;
  std::string prefix_;
};

}  // namespace upswing
