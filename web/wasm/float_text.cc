// Doubles with a given number of digits, and doubles from 2^53 on in full. libc++ has tables of 104
// kB for them (ryu/d2fixed.cpp), a quarter of the module. This uses printf instead, so that the
// tables are not linked.
#include <algorithm>
#include <array>
#include <charconv>
#include <cstdint>
#include <cstdio>

namespace {

std::to_chars_result Print(char* first, char* last, const char* format, double value,
                           uint32_t precision) {
  std::array<char, 2048> text;  // 309 digits before the point, 1074 behind it
  const int size =
      std::snprintf(text.data(), text.size(), format, static_cast<int>(precision), value);
  if (last - first < size) return {last, std::errc::value_too_large};
  return {std::copy_n(text.data(), size, first), std::errc()};
}

}  // namespace

_LIBCPP_BEGIN_NAMESPACE_STD

to_chars_result __d2fixed_buffered_n(char* first, char* last, double value, uint32_t precision) {
  return Print(first, last, "%.*f", value, precision);
}

to_chars_result __d2exp_buffered_n(char* first, char* last, double value, uint32_t precision) {
  return Print(first, last, "%.*e", value, precision);
}

_LIBCPP_END_NAMESPACE_STD
