// Doubles as text, and back, by printf and strtod. libc++ has tables for both: 12 kB for reading,
// and 104 kB for a given number of digits and for doubles from 2^53 on (ryu/d2fixed.cpp). With
// these definitions the linker leaves the tables out. Both round correctly and give the same bits.
#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <string>

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

using Read = std::__from_chars_result<double>;

/// The definition of __from_chars_floating_point<double> in charconv.cpp is weak. This one has the
/// same name and is not.
Read ReadDouble(const char* first, const char* last, std::chars_format) __asm__(
    "_ZNSt3__127__from_chars_floating_pointIdEENS_19__from_chars_resultIT_EEPKcS5_NS_12chars_"
    "formatE");

Read ReadDouble(const char* first, const char* last, std::chars_format) {
  // strtod takes more than from_chars: spaces, a plus and hexadecimal numbers.
  const std::string text(first, std::find_if(first, last, [](char c) {
                           return c == 'x' || c == 'X' || c == 'p' || c == 'P';
                         }));
  if (text.empty() || text[0] == '+' || text[0] <= ' ') return {0, 0, std::errc::invalid_argument};
  char* end = nullptr;
  const double value = std::strtod(text.c_str(), &end);
  if (end == text.c_str()) return {0, 0, std::errc::invalid_argument};
  const bool overflows = std::isinf(value) && text.find_first_of("iI") > 1;
  return {value, end - text.c_str(), overflows ? std::errc::result_out_of_range : std::errc()};
}

_LIBCPP_BEGIN_NAMESPACE_STD

to_chars_result __d2fixed_buffered_n(char* first, char* last, double value, uint32_t precision) {
  return Print(first, last, "%.*f", value, precision);
}

to_chars_result __d2exp_buffered_n(char* first, char* last, double value, uint32_t precision) {
  return Print(first, last, "%.*e", value, precision);
}

_LIBCPP_END_NAMESPACE_STD
