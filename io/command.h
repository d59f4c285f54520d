#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

namespace upswing {

/// What a program said, and how it ended.
struct CommandResult {
  int exit_code = 0;
  int signal = 0;  // that ended it; 0: none
  std::string output, errors;

  bool succeeded() const { return exit_code == 0 && signal == 0; }
};

/// Runs a program of the PATH with these words, the first of which is its name, and waits for its
/// end; no shell is involved. It reads `input`. Nothing if there is no such program. Throws
/// Failure.
std::optional<CommandResult> RunCommand(std::vector<std::string> words,
                                        const std::string& input = "");

/// The file of this very program.
std::filesystem::path ProgramPath();

}  // namespace upswing
