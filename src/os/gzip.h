#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <string_view>

#include "os/file.h"

namespace upswing {

/// Whether the bytes begin as a gzip file does.
bool IsGzip(std::string_view bytes);

/// Inflates a gzip file, which may have several members. Stops as soon as the text is larger than
/// `most_bytes`, or than 1 MiB and 100 times the file. Throws BadInput, with `where` (a path), for
/// a damaged file or a larger text.
std::string Gunzip(std::string_view bytes, const std::string& where,
                   size_t most_bytes = kMostTextBytes);

/// Compresses a text as a gzip file.
std::string Gzip(std::string_view text);

/// CRC-32 of IEEE 802.3, as PNG files and most microcontrollers compute it.
uint32_t Crc32(std::span<const std::byte> bytes);

}  // namespace upswing
