#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <span>
#include <string>

#include "base/text.h"

namespace upswing {

/// Checksum that detects broken files, not forged ones. It is FNV-1a (offset basis and prime) with
/// two changes. It takes 8-byte words, and zeros pad the last word of each Update. It also folds
/// the high half of the hash into the low half.
class Checksum {
 public:
  void Update(std::span<const std::byte> bytes) {
    for (; bytes.size() >= 8; bytes = bytes.subspan(8)) Mix(bytes);
    if (!bytes.empty()) Mix(bytes);
  }

  /// The checksum as 16 hexadecimal digits.
  std::string Hex() const { return HexDigits(hash_, 16); }

 private:
  void Mix(std::span<const std::byte> bytes) {
    uint64_t word = 0;
    std::memcpy(&word, bytes.data(), std::min<size_t>(8, bytes.size()));
    hash_ = (hash_ ^ word) * 0x100000001b3;
    hash_ ^= hash_ >> 32;  // a product spreads bits only upwards
  }
  uint64_t hash_ = 0xcbf29ce484222325;
};

}  // namespace upswing
