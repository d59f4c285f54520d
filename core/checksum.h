#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <span>
#include <string>

#include "core/text.h"

namespace upswing {

/// Detects broken files, not forged ones. Like FNV-1a (its offset basis and prime), but over 8-byte
/// words, the last of each Update padded with zeros, and with the high half folded into the low
/// one.
class Checksum {
 public:
  void Update(std::span<const std::byte> bytes) {
    for (; bytes.size() >= 8; bytes = bytes.subspan(8)) Mix(bytes);
    if (!bytes.empty()) Mix(bytes);
  }

  /// 16 hexadecimal digits.
  std::string Hex() const { return HexDigits(hash_, 16); }

 private:
  void Mix(std::span<const std::byte> bytes) {
    uint64_t word = 0;
    std::memcpy(&word, bytes.data(), std::min<size_t>(8, bytes.size()));
    hash_ = (hash_ ^ word) * 0x100000001b3;
    hash_ ^= hash_ >> 32;  // a product spreads bits upwards only
  }
  uint64_t hash_ = 0xcbf29ce484222325;
};

}  // namespace upswing
