#pragma once

#include <fmt/format.h>

#include <string_view>
#include <utility>

namespace upswing {

/// Opens standard input, output and error where they were closed, so that no file of ours gets
/// their numbers. They stay what they were: nothing comes in, and every write fails.
void OpenStandardFiles();

/// `text` on standard output, for people who watch long work: if it cannot be written the work
/// continues, and the program reports it at its end.
void SayText(std::string_view text);
template <typename... T>
void Say(fmt::format_string<T...> format, T&&... arguments) {
  SayText(fmt::format(format, std::forward<T>(arguments)...));
}

/// `upswing: MESSAGE` on standard error, if that can be written.
void SayError(std::string_view message) noexcept;

}  // namespace upswing
