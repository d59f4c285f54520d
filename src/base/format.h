#pragma once

#include <concepts>
#include <cstdint>
#include <numbers>
#include <string>

/// Formatting of numbers for people.
namespace upswing {

inline constexpr double kDegrees = 180 / std::numbers::pi;  // degrees in a radian

/// Formats a duration: `8.3 s`, `2 min 05 s`, `1 h 04 min`.
std::string FormatDuration(double seconds);

/// Shortens a text to at most `most` bytes: an ellipsis, then the end of the text.
std::string Shortened(const std::string& text, size_t most);

/// Formats a whole number with commas between groups of three digits: `1,250,000`.
std::string FormatCount(double number);
template <std::integral T>
std::string FormatCount(T number) {
  return FormatCount(static_cast<double>(number));
}

/// Formats a number with `digits` significant digits without an exponent, and without zeros at the
/// end of a fraction: `0.00015`, `12.3`, `1250`.
std::string FormatPlain(double number, int digits);

/// Formats a share as a percentage with two significant digits: `0.034%`, `12%`, `100%`.
std::string FormatPercent(double share);

/// Formats a count of a noun: `1 run`, `3 runs`.
std::string Counted(int64_t count, const std::string& noun);

}  // namespace upswing
