#pragma once

#include <cstdint>
#include <span>
#include <string>

namespace upswing {

/// A picture as a PNG file: `rgb` holds pixels (height × width × 3), the top row first.
std::string EncodePng(std::span<const uint8_t> rgb, int width, int height);

}  // namespace upswing
