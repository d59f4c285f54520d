#pragma once

#include <fmt/format.h>

#include <string_view>
#include <utility>

namespace upswing {

/// Prints `text` on standard output for people who watch long work. If this fails, the work
/// continues, and the program reports the failure at its end.
void SayText(std::string_view text);
template <typename... T>
void Say(fmt::format_string<T...> format, T&&... arguments) {
  SayText(fmt::format(format, std::forward<T>(arguments)...));
}

/// The command that starts this program, for examples and hints: `upswing` if it is installed,
/// `./upswing` in the source repository.
std::string_view LaunchCommand();

/// Prints `upswing: MESSAGE` on standard error; ignores failure.
void SayError(std::string_view message) noexcept;

}  // namespace upswing
