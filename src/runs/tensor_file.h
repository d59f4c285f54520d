#pragma once

#include <cstddef>
#include <filesystem>
#include <limits>
#include <string_view>

#include "base/tensors.h"

/// Safetensors files (base/safetensors.h) on disk.
namespace upswing {

/// Writes the file atomically, with a checksum. Throws Failure.
void SaveTensors(const Tensors& tensors, const std::filesystem::path& path);

/// Size limit for policy files: two networks of eight layers of 4096 units fit.
inline constexpr size_t kMostPolicyBytes = size_t{1} << 31;

/// Reads a file and checks sizes, shapes, offsets and checksum. Throws BadInput, also if the file
/// is larger than `most_bytes` or than the free memory.
Tensors LoadTensors(const std::filesystem::path& path,
                    size_t most_bytes = std::numeric_limits<size_t>::max());

/// Reads only the metadata and the tensors whose names begin with `prefix`, to display a small part
/// of a large file. They may have kMostTextBytes. Does not verify the checksum, which covers the
/// whole file; use LoadTensors to work with the file. Throws BadInput.
Tensors LoadPartOfTensors(const std::filesystem::path& path, std::string_view prefix);

}  // namespace upswing
