#pragma once

#include <cstdint>
#include <span>
#include <string>

namespace upswing {

/// Encodes a picture as a PNG file: `rgb` holds pixels (height × width × 3), top row first.
std::string EncodePng(std::span<const uint8_t> rgb, int width, int height);

}  // namespace upswing
