#pragma once

#include <cstddef>
#include <cstdint>
#include <map>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "base/error.h"
#include "base/tensors.h"

/// The safetensors format (https://huggingface.co/docs/safetensors, "Format"), in memory.
///
/// The metadata also hold a checksum of the whole, which reading verifies. A file with an
/// `upswing_version` must have a checksum; files of other programs need none. The bytes are not
/// trusted. Reading takes at most three times their size in memory, because bfloat16 numbers become
/// float. A header has at most 1 MiB.
namespace upswing {

/// The bytes of a file: `head`, then the bytes of the tensors.
struct Safetensors {
  std::vector<std::byte> head;                     // length of the header, then the header
  std::vector<std::span<const std::byte>> bodies;  // views of the tensors

  /// All bytes in one piece.
  std::vector<std::byte> Joined() const;
};

/// Writes tensors with a checksum. Throws Failure if names and metadata are too long to be read
/// again, or are not UTF-8.
Safetensors WriteSafetensors(const Tensors& tensors);

/// Reads tensors and checks sizes, shapes, offsets and checksum. `where` names the source of the
/// bytes in messages. Throws BadInput.
Tensors ReadSafetensors(std::vector<std::byte> content, std::string where);

/// A tensor without its bytes, and the position of its bytes after the header.
struct SafetensorsEntry {
  Tensor tensor;
  size_t begin, size;
};

/// Contents of a header.
struct SafetensorsHeader {
  std::map<std::string, std::string> metadata;
  std::map<std::string, SafetensorsEntry> entries;  // by tensor name
};

// For readers of a part of a large file. The errors of these functions do not name the file.

/// Reads the length of the header from a file's first eight bytes and checks it against the size of
/// the file. Throws BadInput.
uint64_t ReadSafetensorsLength(std::span<const std::byte> first_bytes, uint64_t file_size);

/// Reads a header of tensors that have `data_size` bytes together. Throws BadInput.
SafetensorsHeader ReadSafetensorsHeader(std::string_view text, size_t data_size);

/// The error for a file that is broken or incomplete.
Error BrokenSafetensors(const std::string& where, std::string_view why);

}  // namespace upswing
