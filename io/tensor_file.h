#pragma once

#include <filesystem>
#include <string_view>

#include "core/tensors.h"

/// Safetensors files (core/safetensors.h) on disk.
namespace upswing {

/// Writes the file atomically, with a checksum. Throws Failure.
void SaveTensors(const Tensors& tensors, const std::filesystem::path& path);

/// Reads and checks everything: sizes, shapes, offsets, checksum. Throws BadInput.
Tensors LoadTensors(const std::filesystem::path& path);

/// Reads only the metadata and the tensors whose names begin with `prefix`, a small part of a large
/// file, for display. The checksum, which covers the whole file, is not verified; use LoadTensors
/// to work with the file. Throws BadInput.
Tensors LoadPartOfTensors(const std::filesystem::path& path, std::string_view prefix);

}  // namespace upswing
