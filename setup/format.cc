#include "setup/format.h"

#include <fmt/format.h>

#include <cmath>
#include <cstdint>

namespace upswing {

std::string FormatDuration(double seconds) {
  if (seconds < 60) return fmt::format("{:.1f} s", seconds);
  const auto whole = static_cast<int64_t>(std::llround(seconds));
  if (whole < 3600) return fmt::format("{} min {:02} s", whole / 60, whole % 60);
  return fmt::format("{} h {:02} min", whole / 3600, whole / 60 % 60);
}

std::string Shortened(const std::string& text, size_t most) {
  if (text.size() <= most) return text;
  size_t begin = text.size() - (most - 1);
  while ((text[begin] & 0xC0) == 0x80) ++begin;  // within a character of UTF-8
  return "…" + text.substr(begin);
}

std::string FormatCount(double number) {
  const std::string digits = std::to_string(std::llround(number));
  std::string grouped;
  for (size_t i = 0; i < digits.size(); ++i) {
    const bool group_begins = i > 0 && (digits.size() - i) % 3 == 0 && digits[i - 1] != '-';
    if (group_begins) grouped += ',';
    grouped += digits[i];
  }
  return grouped;
}

}  // namespace upswing
