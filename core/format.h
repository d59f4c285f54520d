#pragma once

#include <concepts>
#include <cstdint>
#include <numbers>
#include <string>

/// Numbers as people read them.
namespace upswing {

inline constexpr double kDegrees = 180 / std::numbers::pi;  // in a radian

/// Seconds as people read them: `8.3 s`, `2 min 05 s`, `1 h 04 min`.
std::string FormatDuration(double seconds);

/// The end of a text of more than `most` bytes, after an ellipsis.
std::string Shortened(const std::string& text, size_t most);

/// A whole number with commas between groups of three digits: `1,250,000`.
std::string FormatCount(double number);
template <std::integral T>
std::string FormatCount(T number) {
  return FormatCount(static_cast<double>(number));
}

/// A count of a noun: `1 run`, `3 runs`.
std::string Counted(int64_t count, const std::string& noun);

}  // namespace upswing
