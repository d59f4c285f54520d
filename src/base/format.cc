#include "base/format.h"

#include <algorithm>
#include <charconv>
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

std::string FormatPlain(double number, int digits) {
  constexpr int kMostDecimals = 12;  // smaller numbers count as 0
  const double size = std::abs(number);
  const double before = size > 0 ? std::floor(std::log10(size)) : 0;
  const int decimals =
      static_cast<int>(std::clamp(digits - 1 - before, 0.0, double{kMostDecimals}));
  std::string plain(400, '\0');  // the longest finite number has 309 digits
  const auto end = std::to_chars(plain.data(), plain.data() + plain.size(), number,
                                 std::chars_format::fixed, decimals);
  plain.resize(static_cast<size_t>(end.ptr - plain.data()));
  if (decimals > 0) {
    plain.erase(plain.find_last_not_of('0') + 1);
    if (plain.ends_with('.')) plain.pop_back();
  }
  return plain == "-0" ? "0" : plain;
}

std::string FormatPercent(double share) { return FormatPlain(100 * share, 2) + "%"; }

std::string Counted(int64_t count, const std::string& noun) {
  return Concat(count, ' ', noun, count == 1 ? "" : "s");
}

}  // namespace upswing
