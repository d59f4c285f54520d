#pragma once

#include <stdexcept>
#include <string>

namespace upswing {

/// The project's one exception type. The message is one line for the user: what was expected,
/// what was given, and where. `exit_code` is the program's exit status if it is not handled.
class Error : public std::runtime_error {
 public:
  Error(int exit_code, const std::string& message)
      : std::runtime_error(message), exit_code_(exit_code) {}

  /// 2 for bad usage or input, 1 for work that failed.
  int exit_code() const { return exit_code_; }

 private:
  int exit_code_;
};

/// Bad usage or bad input: the user can correct it (exit code 2).
inline Error BadInput(const std::string& message) { return {2, message}; }

/// The work itself failed: a full disk, a number that is not finite (exit code 1).
inline Error Failure(const std::string& message) { return {1, message}; }

}  // namespace upswing
