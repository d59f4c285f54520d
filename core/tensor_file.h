#pragma once

#include <cstddef>
#include <cstdint>
#include <deque>
#include <filesystem>
#include <map>
#include <span>
#include <string>
#include <string_view>
#include <vector>

namespace upswing {

/// Number types that our files hold, with the names that safetensors gives them.
enum class Dtype { kU8, kF32, kF64, kI64, kU64 };

std::string_view NameOf(Dtype dtype);
size_t SizeOf(Dtype dtype);

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

/// A named array in a file; a view of its bytes.
struct Tensor {
  Dtype dtype;
  std::vector<int64_t> shape;  // row-major; empty for a scalar
  std::span<const std::byte> bytes;

  /// Such as `F32 [256, 8]`, for messages.
  std::string Describe() const;
};

/// A safetensors file: named tensors and text metadata
/// (https://huggingface.co/docs/safetensors, "Format"). In addition, the metadata hold a checksum
/// of the whole file, which Load verifies. A file with an `upswing_version` must have one; those of
/// other writers need not. Files are not trusted: loading takes no more memory than their size, and
/// a header has at most 1 MiB.
class TensorFile {
 public:
  TensorFile() = default;
  TensorFile(const TensorFile&) = delete;
  TensorFile& operator=(const TensorFile&) = delete;
  TensorFile(TensorFile&&) = default;
  TensorFile& operator=(TensorFile&&) = default;

  std::map<std::string, std::string> metadata;

  /// Adds a view of `values`, which must stay valid until Save. Without a shape: one dimension.
  template <typename T>
  void Add(const std::string& name, std::span<const T> values, std::vector<int64_t> shape = {}) {
    if (shape.empty()) shape = {static_cast<int64_t>(values.size())};
    tensors_[name] = {kDtypeOf<T>, std::move(shape), std::as_bytes(values)};
  }

  /// Adds a copy of a scalar.
  template <typename T>
  void AddScalar(const std::string& name, T value) {
    const auto bytes = std::as_bytes(std::span(&value, 1));
    const auto& kept = kept_.emplace_back(bytes.begin(), bytes.end());
    tensors_[name] = {kDtypeOf<T>, {}, kept};
  }

  const std::map<std::string, Tensor>& tensors() const { return tensors_; }

  /// Copies a tensor into `values`. Throws BadInput, which names file, tensor, what was expected
  /// and what was found, unless it has this type and number of elements, and the shape if one is
  /// given.
  template <typename T>
  void Read(const std::string& name, std::span<T> values,
            const std::vector<int64_t>& shape = {}) const {
    ReadBytes(name, kDtypeOf<T>, shape, std::as_writable_bytes(values));
  }

  /// Throws as Read does unless the tensor has this type and shape. To be called before memory for
  /// it is allocated, so that a false size in a header takes none.
  void Expect(const std::string& name, Dtype dtype, const std::vector<int64_t>& shape) const;

  /// Number of elements of a tensor of type T; throws as Read does.
  template <typename T>
  size_t Count(const std::string& name) const {
    return Find(name, kDtypeOf<T>).bytes.size() / sizeof(T);
  }

  /// The metadata under a key; throws BadInput if there are none.
  const std::string& Metadata(const std::string& key) const;

  /// Whether the loaded file had a checksum, which was then right.
  bool has_checksum() const { return has_checksum_; }

  /// Writes atomically, with a checksum. Throws Failure.
  void Save(const std::filesystem::path& path) const;

  /// Reads and checks everything: sizes, shapes, offsets, checksum. Throws BadInput.
  static TensorFile Load(const std::filesystem::path& path);

  /// Load, from a file's bytes; `where` is used as its path in messages.
  static TensorFile Parse(std::vector<std::byte> content, std::string where);

  /// Reads only the metadata and the tensors whose names begin with `prefix`, a small part of a
  /// large file, for display. The checksum, which covers the whole file, is not verified; use Load
  /// to work with the file. Throws BadInput.
  static TensorFile LoadPart(const std::filesystem::path& path, std::string_view prefix);

  /// Where it was loaded from, for messages.
  const std::string& path() const { return path_; }

 private:
  const Tensor& Find(const std::string& name, Dtype dtype) const;
  void ReadBytes(const std::string& name, Dtype dtype, const std::vector<int64_t>& shape,
                 std::span<std::byte> bytes) const;

  std::string path_;
  bool has_checksum_ = false;
  std::map<std::string, Tensor> tensors_;
  std::deque<std::vector<std::byte>> kept_;  // bytes that tensors_ views and no caller owns
};

}  // namespace upswing
