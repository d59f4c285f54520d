#pragma once

#include <cstddef>
#include <cstdint>
#include <map>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "core/error.h"
#include "core/tensors.h"

/// The safetensors format (https://huggingface.co/docs/safetensors, "Format"), in memory. In
/// addition, the metadata hold a checksum of the whole, which reading verifies. What has an
/// `upswing_version` must have one; what other programs wrote need not. The bytes are not trusted:
/// reading takes no more memory than three times their size (numbers of bfloat16 become float), and
/// a header has at most 1 MiB.
namespace upswing {

/// Tensors as a file's bytes: `head`, then the tensors' own.
struct Safetensors {
  std::vector<std::byte> head;                     // the header's length, the header
  std::vector<std::span<const std::byte>> bodies;  // views of the tensors

  /// All of it in one piece.
  std::vector<std::byte> Joined() const;
};

/// With a checksum. Throws Failure if names and metadata are too long to be read again, or not
/// UTF-8.
Safetensors WriteSafetensors(const Tensors& tensors);

/// Reads and checks everything: sizes, shapes, offsets, checksum. `where` says where the bytes are
/// from. Throws BadInput.
Tensors ReadSafetensors(std::vector<std::byte> content, std::string where);

/// A tensor whose bytes are still to be found, and where they stand behind the header.
struct SafetensorsEntry {
  Tensor tensor;
  size_t begin, size;
};

/// The contents of a header.
struct SafetensorsHeader {
  std::map<std::string, std::string> metadata;
  std::map<std::string, SafetensorsEntry> entries;  // of the tensors
};

// For readers that want a part of a large file; the errors that these throw do not say where.

/// Length of the header that follows, from a file's first eight bytes, checked against the size of
/// the file. Throws BadInput.
uint64_t ReadSafetensorsLength(std::span<const std::byte> first_bytes, uint64_t file_size);

/// Reads a header, whose tensors have `data_size` bytes together. Throws BadInput.
SafetensorsHeader ReadSafetensorsHeader(std::string_view text, size_t data_size);

/// The error about a file that is not a whole one.
Error BrokenSafetensors(const std::string& where, std::string_view why);

}  // namespace upswing
