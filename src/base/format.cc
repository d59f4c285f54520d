#include "base/format.h"

#include <cmath>

#include "base/text.h"

namespace upswing {

std::string FormatDuration(double seconds) {
  if (seconds < 60) {
    const auto tenths = static_cast<int64_t>(std::llround(10 * seconds));
    return Concat(tenths / 10, ".", tenths % 10, " s");
  }
  const auto whole = static_cast<int64_t>(std::llround(seconds));
  const auto two_digits = [](int64_t x) { return Concat(x < 10 ? "0" : "", x); };
  if (whole < 3600) return Concat(whole / 60, " min ", two_digits(whole % 60), " s");
  return Concat(whole / 3600, " h ", two_digits(whole / 60 % 60), " min");
}

std::string Shortened(const std::string& text, size_t most) {
  if (text.size() <= most) return text;
  size_t begin = text.size() - (most - 1);
  while ((text[begin] & 0xC0) == 0x80) ++begin;  // do not begin within a UTF-8 character
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

std::string Counted(int64_t count, const std::string& noun) {
  return Concat(count, ' ', noun, count == 1 ? "" : "s");
}

}  // namespace upswing
