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

/// Number types of tensors, with their safetensors names. BF16 (bfloat16, the upper half of F32's
/// bits) occurs only in files: Widen makes it F32 after reading.
enum class Dtype { kU8, kBF16, kF32, kF64, kI64, kU64 };

std::string_view NameOf(Dtype dtype);
size_t SizeOf(Dtype dtype);
/// The number type with this name; nothing if there is none.
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

/// A view of an array of numbers.
struct Tensor {
  Dtype dtype;
  std::vector<int64_t> shape;  // row-major; empty for a scalar
  std::span<const std::byte> bytes;

  /// Type and shape for messages, such as `F32 [256, 8]`.
  std::string Describe() const;
};

/// Named tensors and text metadata in memory. Policies, checkpoints and safetensors files
/// (base/safetensors.h) consist of them.
class Tensors {
 public:
  Tensors() = default;
  /// Tensors that were read from `where`. Messages about them begin with it.
  explicit Tensors(std::string where) : where_(std::move(where)) {}
  Tensors(const Tensors&) = delete;
  Tensors& operator=(const Tensors&) = delete;
  Tensors(Tensors&&) = default;
  Tensors& operator=(Tensors&&) = default;

  std::map<std::string, std::string> metadata;

  /// Adds a view of `values`, which must stay valid while this object is in use. Without a shape,
  /// the tensor has one dimension.
  template <typename T>
  void Add(const std::string& name, std::span<const T> values, std::vector<int64_t> shape = {}) {
    if (shape.empty()) shape = {static_cast<int64_t>(values.size())};
    tensors_[name] = {kDtypeOf<T>, std::move(shape), std::as_bytes(values)};
  }

  /// Adds a copy of `values`. Without a shape, the tensor has one dimension.
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

  /// Adds a tensor of bytes that stay valid, such as the bytes of Keep.
  void Add(const std::string& name, Tensor tensor) { tensors_[name] = std::move(tensor); }
  /// Keeps bytes alive for tensors that view them.
  std::span<const std::byte> Keep(std::vector<std::byte> bytes) {
    return kept_.emplace_back(std::move(bytes));
  }

  const std::map<std::string, Tensor>& all() const { return tensors_; }

  /// Stores F32 tensors as BF16 where every number is a bfloat16. This halves their size without
  /// loss.
  void Narrow();
  /// Turns BF16 tensors into F32.
  void Widen();

  /// Copies a tensor into `values`. Throws BadInput unless the type, the number of elements and the
  /// shape (if given) match. The message has the place, the tensor, the expected and the found
  /// value.
  template <typename T>
  void Read(const std::string& name, std::span<T> values,
            const std::vector<int64_t>& shape = {}) const {
    ReadBytes(name, kDtypeOf<T>, shape, std::as_writable_bytes(values));
  }

  /// Throws BadInput unless the tensor has this type and shape. Call it before you allocate memory
  /// for the tensor, so that a false size takes no memory.
  void Expect(const std::string& name, Dtype dtype, const std::vector<int64_t>& shape) const;

  /// Number of elements of a tensor of type T. Throws BadInput if the tensor is missing or has
  /// another type.
  template <typename T>
  size_t Count(const std::string& name) const {
    return Find(name, kDtypeOf<T>).bytes.size() / sizeof(T);
  }

  /// The metadata under a key. Throws BadInput if the key is missing.
  const std::string& Metadata(const std::string& key) const;
  /// Throws BadInput unless the metadata under a key is this text.
  void ExpectMetadata(const std::string& key, std::string_view expected) const;

  /// Whether the source had a checksum, which was then correct.
  bool has_checksum = false;

  /// Source of the tensors for messages, such as a file's path.
  const std::string& where() const { return where_; }

 private:
  const Tensor& Find(const std::string& name, Dtype dtype) const;
  void ReadBytes(const std::string& name, Dtype dtype, const std::vector<int64_t>& shape,
                 std::span<std::byte> bytes) const;

  std::string where_;
  std::map<std::string, Tensor> tensors_;
  /// Bytes that tensors_ views and that have no other owner.
  std::deque<std::vector<std::byte>> kept_;
};

}  // namespace upswing
