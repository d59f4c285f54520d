// Doubles as text, and back, by printf and strtod, because charconv.cpp of libc++ has tables of 130
// kB. Both round correctly and give the same bits. 46 of the 2,098 powers of two, 2^-24 for one,
// get a digit more here.
#include <array>
#include <charconv>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <string>

using Read = std::__from_chars_result<double>;

/// The function that the headers of libc++ declare under this name.
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

to_chars_result to_chars(char* first, char* last, double value, chars_format format,
                         int precision) {
  array<char, 2048> text;  // 309 digits before the point, 1074 behind it
  const int size =
      format == chars_format::general
          ? snprintf(text.data(), text.size(), "%.*g", precision, value)
          : snprintf(text.data(), text.size(), format == chars_format::fixed ? "%.*f" : "%.*e",
                     precision, value);
  if (last - first < size) return {last, errc::value_too_large};
  return {copy_n(text.data(), size, first), errc()};
}

/// Writes the fewest decimals that are read as the same value.
to_chars_result to_chars(char* first, char* last, double value, chars_format format) {
  for (int decimals = 0;; ++decimals) {
    const auto result = to_chars(first, last, value, format, decimals);
    if (result.ec != errc() || isnan(value)) return result;
    if (ReadDouble(first, result.ptr, format).__value == value) return result;
  }
}

/// Writes the shorter notation.
to_chars_result to_chars(char* first, char* last, double value) {
  array<char, 32> text;
  const auto scientific = to_chars(text.begin(), text.end(), value, chars_format::scientific);
  const auto fixed = to_chars(first, last, value, chars_format::fixed);
  const ptrdiff_t size = scientific.ptr - text.begin();
  if (fixed.ec == errc() && fixed.ptr - first <= size) return fixed;
  if (last - first < size) return fixed;
  return {copy_n(text.begin(), size, first), errc()};
}

_LIBCPP_END_NAMESPACE_STD
