#pragma once

#include <stdexcept>
#include <string>

namespace upswing {

/// The project's only exception type. The message is one line for the user. It names the place, the
/// expected and the given input. `exit_code` is the program's exit status if nothing handles the
/// error.
class Error : public std::runtime_error {
 public:
  Error(int exit_code, const std::string& message)
      : std::runtime_error(WithoutNul(message)), exit_code_(exit_code) {}

  /// Exit status: 2 for bad usage or input, 1 for work that failed.
  int exit_code() const { return exit_code_; }

 private:
  /// Escapes NUL characters, because what() would end at the first.
  static std::string WithoutNul(std::string message) {
    for (size_t at = 0; (at = message.find('\0')) != std::string::npos;) {
      message.replace(at, 1, "\\x00");
    }
    return message;
  }

  int exit_code_;
};

/// Error of usage or input that the user can correct (exit code 2).
inline Error BadInput(const std::string& message) { return {2, message}; }

/// Error of the work itself, such as a full disk or a number that is not finite (exit code 1).
inline Error Failure(const std::string& message) { return {1, message}; }

}  // namespace upswing
