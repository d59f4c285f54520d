#pragma once

#include <cstddef>
#include <cstdint>
#include <deque>
#include <map>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

namespace upswing {

/// Number types of tensors, with the names that safetensors gives them. BF16 (bfloat16, the upper
/// half of F32's bits) is one of files alone: what is read of it is F32.
enum class Dtype { kU8, kBF16, kF32, kF64, kI64, kU64 };

std::string_view NameOf(Dtype dtype);
size_t SizeOf(Dtype dtype);
/// The type of this name; nothing if there is none.
std::optional<Dtype> DtypeCalled(std::string_view name);

template <typename T>
constexpr Dtype kDtypeOf =
    [] { static_assert(sizeof(T) == 0, "no safetensors type for this C++ type"); }();
template <>
inline constexpr Dtype kDtypeOf<uint8_t> = Dtype::kU8;
template <>
inline constexpr Dtype kDtypeOf<float> = Dtype::kF32;
template <>
inline constexpr Dtype kDtypeOf<double> = Dtype::kF64;
template <>
inline constexpr Dtype kDtypeOf<int64_t> = Dtype::kI64;
template <>
inline constexpr Dtype kDtypeOf<uint64_t> = Dtype::kU64;

/// An array of numbers; a view of its bytes.
struct Tensor {
  Dtype dtype;
  std::vector<int64_t> shape;  // row-major; empty for a scalar
  std::span<const std::byte> bytes;

  /// Such as `F32 [256, 8]`, for messages.
  std::string Describe() const;
};

/// Named tensors and text metadata in memory: what a policy or a checkpoint is made of, and what a
/// safetensors file holds (core/safetensors.h).
class Tensors {
 public:
  Tensors() = default;
  /// Tensors that were read from `where`, which begins the messages about them.
  explicit Tensors(std::string where) : where_(std::move(where)) {}
  Tensors(const Tensors&) = delete;
  Tensors& operator=(const Tensors&) = delete;
  Tensors(Tensors&&) = default;
  Tensors& operator=(Tensors&&) = default;

  std::map<std::string, std::string> metadata;

  /// Adds a view of `values`, which must stay valid as long as this is used. Without a shape: one
  /// dimension.
  template <typename T>
  void Add(const std::string& name, std::span<const T> values, std::vector<int64_t> shape = {}) {
    if (shape.empty()) shape = {static_cast<int64_t>(values.size())};
    tensors_[name] = {kDtypeOf<T>, std::move(shape), std::as_bytes(values)};
  }

  /// The same with a copy of `values`.
  template <typename T>
  void AddCopy(const std::string& name, std::span<const T> values,
               std::vector<int64_t> shape = {}) {
    Add(name, values, std::move(shape));
    const auto bytes = tensors_[name].bytes;
    tensors_[name].bytes = Keep({bytes.begin(), bytes.end()});
  }

  /// Adds a copy of a scalar.
  template <typename T>
  void AddScalar(const std::string& name, T value) {
    AddCopy(name, std::span<const T>(&value, 1));
    tensors_[name].shape.clear();
  }

  /// Adds a tensor whose bytes stay valid, such as those of Keep.
  void Add(const std::string& name, Tensor tensor) { tensors_[name] = std::move(tensor); }
  /// Holds bytes that tensors view.
  std::span<const std::byte> Keep(std::vector<std::byte> bytes) {
    return kept_.emplace_back(std::move(bytes));
  }

  const std::map<std::string, Tensor>& all() const { return tensors_; }

  /// F32 whose numbers are all ones of bfloat16 becomes BF16: half the size, and nothing is lost.
  void Narrow();
  /// BF16 becomes F32.
  void Widen();

  /// Copies a tensor into `values`. Throws BadInput, which says where, which tensor, what was
  /// expected and what was found, unless it has this type and number of elements, and the shape if
  /// one is given.
  template <typename T>
  void Read(const std::string& name, std::span<T> values,
            const std::vector<int64_t>& shape = {}) const {
    ReadBytes(name, kDtypeOf<T>, shape, std::as_writable_bytes(values));
  }

  /// Throws as Read does unless the tensor has this type and shape. To be called before memory for
  /// it is allocated, so that a false size takes none.
  void Expect(const std::string& name, Dtype dtype, const std::vector<int64_t>& shape) const;

  /// Number of elements of a tensor of type T; throws as Read does.
  template <typename T>
  size_t Count(const std::string& name) const {
    return Find(name, kDtypeOf<T>).bytes.size() / sizeof(T);
  }

  /// The metadata under a key; throws BadInput if there are none.
  const std::string& Metadata(const std::string& key) const;

  /// Whether they were read with a checksum, which was then right.
  bool has_checksum = false;

  /// Where they were read from, such as a file's path, for messages.
  const std::string& where() const { return where_; }

 private:
  const Tensor& Find(const std::string& name, Dtype dtype) const;
  void ReadBytes(const std::string& name, Dtype dtype, const std::vector<int64_t>& shape,
                 std::span<std::byte> bytes) const;

  std::string where_;
  std::map<std::string, Tensor> tensors_;
  std::deque<std::vector<std::byte>> kept_;  // bytes that tensors_ views and no caller owns
};

}  // namespace upswing
